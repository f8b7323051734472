"""The phases in free space: lift, transfer to the start, and a pause for taring."""

from abc import abstractmethod
from math import fsum, radians, sqrt
from operator import sub
from typing import Final, Protocol

from typing_extensions import override

from palpate.core.motion import Controller, TipMotion
from palpate.core.ports import ZERO_VELOCITY, Vector3
from palpate.core.tasks.contact.trial_state import TrialState
from palpate.core.trial import Measurement, TaskConfig

_NO_FORCE: Final = (0.0, 0.0, 0.0)
"""Force for the controllers in free space, where none is controlled."""
_UPRIGHT: Final = (0.0, 0.0, 0.0)
_RIGHTING_RAD_S: Final = radians(6.0)
"""Angular speed towards upright; a wrist joint near its singularity turns several times as fast."""
Bias = tuple[float, float, float, float, float, float]


class RunningPhase(Protocol):
    """The current phase of a trial; each phase defines its own entry method.

    Attributes:
        over: True if the latest :meth:`step` completed the phase; False if the trial ended in the phase.
    """

    over: bool

    @abstractmethod
    def step(self) -> Vector3:
        """Return the tip velocity for the current tick, (3,) m/s, task frame."""


class Lift(RunningPhase):
    """Phase that moves the tool straight up to the ready height."""

    def __init__(self, task: TaskConfig, motion: TipMotion, controller: Controller) -> None:
        self._motion, self._controller = motion, controller
        self._ready_z_m = -task.ready_height_mm * 1e-3

    def step(self) -> Vector3:
        """Move up; if the tool is already at that height, the tick belongs to the next phase."""
        x, y, z = self._motion.reference_m
        self.over = z <= self._ready_z_m + 1e-6
        return self._controller.velocity_m_s((x, y, z), (x, y, self._ready_z_m), _NO_FORCE)


class Transfer(RunningPhase):
    """Phase that moves the tool to the trial's start at the ready height, and rotates it upright if necessary."""

    def __init__(self, task: TaskConfig, motion: TipMotion, controller: Controller, state: TrialState) -> None:
        self._motion, self._controller, self._state = motion, controller, state
        self._ready_z_m = -task.ready_height_mm * 1e-3

    @override
    def step(self) -> Vector3:
        reference = self._motion.reference_m
        target = (*self._state.report.setup.start_m, self._ready_z_m)
        upright = self._motion.turn_rad == _UPRIGHT
        if not upright:
            self._motion.right(_RIGHTING_RAD_S)
        self.over = upright and max(map(abs, map(sub, reference, target))) < 1e-6
        return self._controller.velocity_m_s(reference, target, _NO_FORCE)


class Settle(RunningPhase):
    """Phase that keeps the tool stationary while vibrations decay and the sensor is tared.

    Attributes:
        bias: The wrench used as zero afterwards, (6,), N and N m, sensor frame; None until it is known.
    """

    def __init__(self, task: TaskConfig, measurement: Measurement, state: TrialState) -> None:
        self._state, self._measurement = state, measurement
        self._tare_ticks = task.tare_ticks

    def begin(self) -> None:
        """Reset the state for a new trial."""
        self.over = False
        self.bias: Bias | None = None
        self._sum, self._values = [0.0] * 6, list[tuple[float, ...]]()

    def enter(self) -> None:
        """Begin the pause."""
        self._countdown = 2 * self._tare_ticks

    @override
    def step(self) -> Vector3:
        self._countdown -= 1
        if self._countdown < self._tare_ticks:
            wrench = self._state.snapshot.wrench
            self._values.append((*wrench.force_N, *wrench.torque_Nm))
            for i, value in enumerate(self._values[-1]):
                self._sum[i] += value
        if self._countdown == 0:
            a, b, c, d, e, f = (total / self._tare_ticks for total in self._sum)
            self.bias = (a, b, c, d, e, f)
            self._measurement.tare(self.bias)
            self._state.noise = tuple(
                sqrt(fsum((value - mean) ** 2 for value in values) / max(self._tare_ticks - 1, 1))
                for values, mean in zip(zip(*self._values, strict=True), self.bias, strict=True)
            )
            self._state.event("tare", f"{a:.6g} {b:.6g} {c:.6g} N, {d:.6g} {e:.6g} {f:.6g} N m, sensor frame")
            self.over = True
        return ZERO_VELOCITY
