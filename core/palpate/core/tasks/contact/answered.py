"""Is the force sensor alive while the tool pushes? It heaves on its way, and the force has to answer."""

from __future__ import annotations

from collections import deque
from math import ceil, hypot
from typing import Final

import numpy as np

from palpate.core.motion import limited
from palpate.core.ports import CONTROL_RATE_HZ, PERIOD_S, STILL, Vector3
from palpate.core.tasks.contact.heave_answer import HeaveAnswer
from palpate.core.tasks.contact.restless import RestlessForce
from palpate.core.tasks.contact.sign_of_life import UnevenHeave
from palpate.core.tasks.contact.trial_state import TrialState
from palpate.core.trial import ControlConfig, Measurement, Purpose, Trip, TripReason, generator

_WINDOW: Final = 64
"""Samples that are held against earlier ones. Over 32, strokes that are drawn come to the same now and then."""
_SOONEST, _LATEST = 8, 2 * CONTROL_RATE_HZ
"""Samples from one time to the next; a shorter recording comes again at multiples of its length, too."""
_MORE_THAN_NOISE: Final = 1.4
"""Two noisy samples of one force differ by twice the noise's square, which was measured with few; by so much more at
most."""
_SHOWN: Final = 1.6
"""What comes again has to be so many times what differs, or it is nothing but a force at rest."""


class Recurrence:
    """Holds the newest forces against those of before, at any distance.

    The heave of a tool is drawn anew all the time, so what a sound sensor shows of it does not come again: in trials
    without a fault, of 6700 answered looks, it seemed to once. In trials that recordings of 0.1 and 1 s had misled it
    did in nearly all looks, half a second after the recording had come round.
    """

    def begin_trial(self) -> None:
        """A trial begins, with other samples."""
        # Newest first; nothing comes again of what was not there.
        self._forces_N = np.full(_LATEST, np.inf)
        # By sample and distance; the oldest row is overwritten.
        self._squares_N2 = np.full((_WINDOW, _LATEST - _SOONEST), np.inf)
        self._row = 0

    def felt(self, force_N: float) -> None:
        """A new sample of the force along the tool axis."""
        forces_N, squares_N2 = self._forces_N, self._squares_N2[self._row]
        forces_N[1:] = forces_N[:-1]
        forces_N[0] = force_N
        np.subtract(forces_N[_SOONEST:], force_N, out=squares_N2)
        np.square(squares_N2, out=squares_N2)
        self._row = (self._row + 1) % _WINDOW

    def comes_again(self, noise_N: float) -> bool:
        """Whether the newest force is, but for noise, what it was at some time before, and shows more than that noise.

        Args:
            noise_N: Standard deviation of the sensor at rest.
        """
        differs_N2 = float(self._squares_N2.sum(axis=0).min())
        if differs_N2 > _MORE_THAN_NOISE * 2.0 * noise_N * noise_N * _WINDOW:
            return False
        newest_N = self._forces_N[:_WINDOW]
        return float(np.square(newest_N - newest_N.mean()).sum()) > _SHOWN * differs_N2


_FEWEST: Final = 8
_FEWEST_STOPPED: Final = 12
"""Samples of a look; a tool that had to stop is to be surer."""
_LOOKS: Final = 8
_ANSWERED: Final = 4
"""So many of the last looks have to be answered, and the newest: a recording fits now and then, and not for long."""
_STAND_TICKS: Final = 14
"""An answer comes in these, mostly. After them the tool goes back to where it had one: there it may have one again, and
a recording that fits by chance lets it push no further than before."""
_BACK_M_S: Final = 8e-3
_MET_N: Final = 2.5
"""It goes back no further against such a force: a corner that sank into the hole meanwhile meets another wall."""
_SHOWN_SHARE: Final = 0.024
"""Of the square of the accelerations that are commanded: an arm on a slow bus makes less of a heave, and its force has
nothing to answer. Simulated servos show 0.03 at least, emulated ones with such a bus 0.02 at most."""
_HIDDEN: Final = 0.25
"""Encoders' steps may give this share, at most, of what has to show at least; or places are taken further apart."""
_MOST_APART_TICKS: Final = 3
"""Over a stroke and more nothing of the heave would be left."""
_LONGEST_TICKS: Final = 2 * CONTROL_RATE_HZ
_QUIET_N: Final = 0.15
"""With a noise of this, or less; a noisier force takes as many times longer to answer."""
_REGAINED: Final = 5
"""So many ticks of waiting are forgiven with each in which it goes on: a recording that fits by chance now and then is
waited for no longer than one that never does."""


class AnsweredForce:
    """Stops a tool that pushes where the force does not answer its heave, and lets it go back and heave until it does.

    Scatter is no answer, as it is to :class:`~palpate.core.tasks.contact.restless.RestlessForce`: a recording
    scatters, and so does noise. Only where the arm does not heave as it is told, by its own encoders, that takes over
    for the rest of the trial.

    Args:
        control: Its stiffnesses are those of the gripper.
        speed_m_s: Of the heave.
        most_N: What the springs of the gripper may come to, at most, by the way from where it was answered last.
        mass_kg: Of all that the force sensor carries.
        step_m: Standard deviation of the depth by the encoders' steps.
    """

    def __init__(
        self,
        state: TrialState,
        measurement: Measurement,
        control: ControlConfig,
        speed_m_s: float,
        most_N: float,
        mass_kg: float,
        step_m: float,
    ) -> None:
        self._state, self._measured, self._most_N = state, measurement, most_N
        self._lateral_N_per_m = control.lateral_stiffness_N_per_mm * 1e3
        self._axial_N_per_m, self._mass_kg = measurement.axial_N_per_m, mass_kg
        # A turn changes the speed by twice that in a tick, and every third tick has one.
        self._least_shown_N2 = _SHOWN_SHARE * (2.0 * mass_kg * speed_m_s * CONTROL_RATE_HZ) ** 2 / 3.0
        # Three places tell it with six times the square of a single one.
        hidden = 6.0 * (mass_kg * step_m * CONTROL_RATE_HZ**2) ** 2 / (_HIDDEN * self._least_shown_N2)
        self._apart_ticks = apart_ticks = min(max(ceil(hidden**0.25), 1), _MOST_APART_TICKS)
        self._heave = UnevenHeave(speed_m_s)
        self._answer = HeaveAnswer(mass_kg, self._axial_N_per_m, apart_ticks)
        self._recurrence = Recurrence()
        self._otherwise = RestlessForce(state, measurement, control, speed_m_s)

    def begin(self) -> None:
        """A trial begins."""
        setup = self._state.report.setup
        self._heave.begin_trial(generator(setup.seed, Purpose.HEAVE, setup.index))
        self._answer.begin_trial()
        self._recurrence.begin_trial()
        self._otherwise.begin()
        self._follows_heaves = True
        self._looks: deque[bool]
        self._sequence: int | None = None
        # The first tick of a heave follows none, be it the trial's first.
        self._tick = -2
        self._along_m_s: float
        self._stood_ticks: int
        self._waited_ticks = 0
        self._answered()

    def _answered(self) -> None:
        self._way_m, self._stopped = (0.0, 0.0, 0.0), False

    @property
    def waits(self) -> bool:
        """Whether the tool goes no further until its heave is answered."""
        return self._stopped if self._follows_heaves else self._otherwise.waits

    def watch(self) -> None:
        """A tick in which the tool may push."""
        state, measured, answer = self._state, self._measured, self._answer
        if not self._follows_heaves:
            self._otherwise.watch()
            return
        wrench, joints = state.snapshot.wrench, state.snapshot.joints
        if wrench.sequence != self._sequence:
            self._sequence = wrench.sequence
            answer.felt(wrench.source_time_ns * 1e-9, measured.force_N[2])
            self._recurrence.felt(measured.force_N[2])
        # Only new ones are told: times go on.
        answer.moved(joints.source_time_ns * 1e-9, measured.position_m[2])
        if not answer.paired(self._tick == state.tick - 1):
            return
        if self._stopped and (shown_N2 := answer.shown_N2) is not None and shown_N2 < self._least_shown_N2:
            text = "the encoders show less of a heave than is commanded: scatter of the force counts instead"
            state.event("heave", text)
            self._follows_heaves = False
            return
        follows = answer.follows(_FEWEST_STOPPED if self._stopped else _FEWEST, state.noise[2])
        if follows is None:
            return
        follows = follows and not self._recurrence.comes_again(state.noise[2])
        self._looks.append(follows)
        if follows and sum(self._looks) >= _ANSWERED * self._apart_ticks:
            self._answered()

    def velocity_m_s(self, velocity_m_s: Vector3) -> Vector3:
        """The velocity, (3,), task frame, for this tick, of a tool that would go on with this one."""
        if not self._follows_heaves:
            return self._otherwise.velocity_m_s(velocity_m_s)
        tick = self._state.tick
        if tick != self._tick:
            # Only once, where an action is chosen in a tick that another one had.
            if tick != self._tick + 1:
                self._begin_heave()
            self._along_m_s, self._tick = self._heave.velocity_m_s(), tick
            if not self._stopped:
                self._waited_ticks = max(self._waited_ticks - _REGAINED, 0)
        x, y, z = self._back_m_s() if self._stopped else velocity_m_s
        way_x, way_y, way_z = self._way_m
        self._way_m = way_x + x * PERIOD_S, way_y + y * PERIOD_S, way_z + z * PERIOD_S
        if self._bend_N > self._most_N and not self._stopped:
            self._stopped, self._stood_ticks = True, 0
            self._looks.clear()
        return x, y, z + self._along_m_s

    @property
    def _bend_N(self) -> float:
        x, y, z = self._way_m
        return hypot(x, y) * self._lateral_N_per_m + abs(z) * self._axial_N_per_m

    def _back_m_s(self) -> Vector3:
        """Velocity of a tool that waits: it stands, and then goes back."""
        if self._waited_ticks >= _LONGEST_TICKS * max(self._state.noise[2] / _QUIET_N, 1.0):
            text = "the force does not answer the heave of a tool that pushed: the force sensor does not show what is"
            if self._answer.other_kg is not None:
                carried_kg = f"{self._answer.other_kg:.2f} kg by its inertia"
                text = f"{text}, or it carries some {carried_kg}, and task.options.tool_kg = {self._mass_kg:g} is wrong"
            self._state.doubt(Trip(TripReason.CONTACT_MISMATCH, self._state.tick, text))
        self._waited_ticks += 1
        self._stood_ticks += 1
        if self._stood_ticks <= _STAND_TICKS:
            return STILL
        (x, y, z), (fx, fy, _) = self._way_m, self._measured.force_N
        if x * fx + y * fy > _MET_N * hypot(x, y):
            return STILL
        return limited((-x / PERIOD_S, -y / PERIOD_S, -z / PERIOD_S), _BACK_M_S)

    def _begin_heave(self) -> None:
        self._heave.begin()
        self._answer.begin()
        # What went before was proved; a sensor that has lied since is found by the next looks.
        apart = self._apart_ticks
        self._looks = deque((not self._stopped,) * (_ANSWERED * apart), maxlen=_LOOKS * apart)
