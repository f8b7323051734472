"""Is the force sensor alive while the tool pushes? What it feels then never rests for long, and a dead one's does."""

from collections import deque
from math import hypot
from typing import Final

from palpate.core.ports import CONTROL_RATE_HZ, PERIOD_S, Vector3
from palpate.core.tasks.contact.sign_of_life import SignOfLife
from palpate.core.tasks.contact.trial_state import TrialState
from palpate.core.trial import ControlConfig, Measurement, Trip, TripReason

_SAMPLES: Final = 8
_DEVIATIONS: Final = 2.2
"""So many of its deviations at rest a channel has to scatter by, in one of which noise alone does so once in 10^4
times."""
_SMOOTH: Final = 1
_SMOOTH_SHARE: Final = 0.3
"""So many second differences, no more, may be below this share of the noise; it makes them 2.4 times itself."""
_UNFELT_N: Final = 20.0
"""What the springs of the gripper may come to, at most, by the way after the newest sign."""
_HEAVED_N: Final = 4.0
"""From so much of it on the tool heaves; below, a way that is felt now and then would be disturbed."""
_HEAVE_M: Final = 2.5e-4
_LONGEST_TICKS: Final = CONTROL_RATE_HZ


class RestlessForce:
    """Stops a tool that pushes where no channel of its sensor shows more than noise, and lets it heave until one does.

    Args:
        control: Its stiffnesses are those of the gripper.
        speed_m_s: The heave is no faster.
    """

    def __init__(self, state: TrialState, measurement: Measurement, control: ControlConfig, speed_m_s: float) -> None:
        self._state, self._measured = state, measurement
        self._lateral_N_per_m = control.lateral_stiffness_N_per_mm * 1e3
        self._axial_N_per_m = control.axial_stiffness_N_per_mm * 1e3
        self._life = SignOfLife(self._axial_N_per_m, _HEAVE_M * self._axial_N_per_m, speed_m_s, in_air=True)

    def begin(self) -> None:
        """A trial begins."""
        self._samples: deque[tuple[float, ...]] = deque(maxlen=_SAMPLES)
        self._sequence: int | None = None
        self._life.begin()
        self._unfelt_N, self._heaved_m = 0.0, 0.0
        self._tick = self._heave_tick = -1
        self._new: bool
        self._waited_ticks: int
        self._life.demand_check()

    @property
    def waits(self) -> bool:
        """Whether the tool stays where it is until something is felt."""
        return self._unfelt_N > _UNFELT_N

    def watch(self) -> None:
        """A tick in which the tool may push."""
        wrench = self._state.snapshot.wrench
        self._new, self._sequence = wrench.sequence != self._sequence, wrench.sequence
        if self._new:
            self._samples.append((*wrench.force_N, *wrench.torque_Nm))
        # A look at all channels takes a tenth of a tick: only where it may change anything.
        if not self._unfelt_N or len(self._samples) < _SAMPLES:
            return
        if any(map(_lives, zip(*self._samples, strict=True), self._state.noise)):
            self._unfelt_N = 0.0

    def velocity_m_s(self, velocity_m_s: Vector3) -> Vector3:
        """The velocity, (3,), task frame, for this tick, of a tool that would go on with this one."""
        x, y, z = velocity_m_s
        if self._state.tick != self._tick:
            # Only once, where an action is chosen in a tick that another one had.
            self._along_m_s = self._next_heave_m_s()
            self._tick = self._state.tick
        along_m_s = self._along_m_s
        if not self.waits:
            self._unfelt_N += (hypot(x, y) * self._lateral_N_per_m + abs(z) * self._axial_N_per_m) * PERIOD_S
            return x, y, z + along_m_s
        if self._waited_ticks == _LONGEST_TICKS:
            text = "the force does not follow a tool that pushed without any: the force sensor is dead"
            self._state.doubt(Trip(TripReason.CONTACT_MISMATCH, self._state.tick, text))
        self._waited_ticks += 1
        return 0.0, 0.0, along_m_s

    def _next_heave_m_s(self) -> float:
        if self._unfelt_N <= _HEAVED_N:
            return 0.0
        if self._state.tick != self._heave_tick + 1:
            self._life.resume()
            self._waited_ticks = 0
        self._heave_tick = self._state.tick
        along_m_s = self._life.heave_m_s()
        self._life.watch(self._measured.force_N[2], self._new, (0.0, 0.0, self._heaved_m))
        self._heaved_m += along_m_s * PERIOD_S
        if not self._life.due:
            self._unfelt_N = 0.0
            self._life.demand_check()
        return along_m_s


def _lives(values: tuple[float, ...], noise: float) -> bool:
    """Whether a channel shows more than its noise, and its noise too: a share of either, or one jump, is no sign."""
    mean = sum(values) / _SAMPLES
    if sum((value - mean) ** 2 for value in values) <= (_DEVIATIONS * noise) ** 2 * (_SAMPLES - 1):
        return False
    bends = sorted(abs(a - 2.0 * b + c) for a, b, c in zip(values, values[1:], values[2:], strict=False))
    return bends[_SMOOTH] > _SMOOTH_SHARE * noise
