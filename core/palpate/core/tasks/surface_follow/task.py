"""The task: down to the first contact, then to and fro along x, pressing along the surface's normal.

The contour is known to nobody. Its slope is that of the way that the tip was led in the last hundredth of a second or
so: as long as the force is even, the gripper's springs are bent evenly, and flange and tip move alike. The force along
the normal is regulated by the damping law alone, or with the slope led ahead of it.
"""

from dataclasses import dataclass
from enum import Enum
from math import sqrt
from typing import Annotated, ClassVar, Final

from typing_extensions import override

from palpate.core.motion import DampingControl, PositionControl, TipMotion
from palpate.core.ports import PERIOD_S, STILL, Range, Settings, Vector3
from palpate.core.tasks.contact import ContactProof, LiftCheck, RunningPhase, TouchTask, TrialState
from palpate.core.trial import (
    N_PER_KGF,
    ControlConfig,
    Measurement,
    Outcome,
    Phase,
    TaskConfig,
    TrialSetup,
    Trip,
    TripReason,
    options_of,
)

_APPROACH_M_S: Final = 0.008
_YIELD_M_S: Final = 0.01
_ARRIVED_M: Final = 5e-5
_SLOPE_SHARE: Final = 0.1
"""Of the newest tick in the slope: it is a mean over some ten ticks."""
_STEEPEST: Final = 1.0


@dataclass(frozen=True)
class FollowOptions(Settings):
    """What only this task has."""

    TABLE: ClassVar[str] = "task.options"

    stroke_mm: Annotated[float, Range(1.0, 1000.0)] = 100.0
    """Length of the way from one turn to the next, along x, with the nominal goal in its middle."""
    way_mm: Annotated[float, Range(1.0, 100_000.0)] = 1000.0
    """Length of the whole way, to and fro."""
    speed_mm_s: Annotated[float, Range(0.1, 200.0)] = 20.0
    """Speed along x."""
    lead_ahead: Annotated[float, Range(0.0, 1.0)] = 1.0
    """Share of the slope that the tool is led by before the force shows it; 0 leaves all to the damping law."""
    relief_mm: Annotated[float, Range(0.1, 50.0)] = 8.0
    """How far the surface may lie above or below the nominal plane; a tip farther off has lost it."""
    tolerance_N: Annotated[float, Range(0.01, 100.0)] = 0.5
    """Root mean square of the normal force less the one asked for, at most."""


class FollowPhase(Enum):
    """What follows on the tare."""

    FOLLOW = "follow"


class FollowTask(TouchTask):
    """A tool that slides along a surface.

    Args:
        task: The settings; ``press_kgf`` is the force asked for.
        measurement: From snapshots to the task frame.

    Raises:
        ConfigurationError: An option or a gain is refused.
    """

    def __init__(self, task: TaskConfig, control: ControlConfig, measurement: Measurement, motion: TipMotion) -> None:
        free = PositionControl(control.position_gain_per_s, task.travel_speed_mm_s * 1e-3, PERIOD_S)
        state, proof = TrialState(), ContactProof(task, control)
        super().__init__(task, measurement, motion, free, state, proof)
        self._approach = ContourApproach(task, control, measurement, motion, state)
        self._follow_way = Follow(task, control, measurement, motion, state, proof)

    @override
    def begin(self, setup: TrialSetup) -> None:
        super().begin(setup)
        self._approach.over = False

    @override
    def _follow(self) -> None:
        if self._state.phase is Phase.SETTLE:
            self._enter(Phase.APPROACH, self._approach)
        else:
            self._follow_way.enter()
            self._enter(FollowPhase.FOLLOW, self._follow_way)


def _press(task: TaskConfig, control: ControlConfig, measurement: Measurement, speed_m_s: float) -> DampingControl:
    """The law along the normal; a force that presses has a negative z."""
    pressing = (0.0, 0.0, -task.press_kgf * N_PER_KGF)
    return DampingControl(control.damping_N_s_per_m, pressing, speed_m_s, measurement.axial_N_per_m, PERIOD_S)


class ContourApproach(RunningPhase):
    """Straight down to the first contact."""

    def __init__(
        self, task: TaskConfig, control: ControlConfig, measurement: Measurement, motion: TipMotion, state: TrialState
    ) -> None:
        self._measurement, self._motion, self._state = measurement, motion, state
        self._law = _press(task, control, measurement, _APPROACH_M_S)
        self._contact_N = task.contact_kgf * N_PER_KGF
        # By the reference, so that the search also ends for an arm that does not follow.
        self._deepest_m = options_of(FollowOptions, task).relief_mm * 1e-3

    @override
    def step(self) -> Vector3:
        measured, reference_m = self._measurement, self._motion.reference_m
        if measured.filtered_force_z_N < -self._contact_N:
            self._state.event("contact", f"surface at {measured.position_m[2] * 1e3:.3f} mm below the nominal plane")
            self.over = True
        elif reference_m[2] > self._deepest_m:
            self._state.end(Outcome.NO_CONTACT, f"nothing touched down to {reference_m[2] * 1e3:.2f} mm")
        return 0.0, 0.0, self._law.velocity_m_s(reference_m, reference_m, measured.force_N)[2]


class Follow(RunningPhase):
    """To and fro along x, with a lift before each stroke that shows whether the force follows the gripper's spring."""

    over = False

    def __init__(
        self,
        task: TaskConfig,
        control: ControlConfig,
        measurement: Measurement,
        motion: TipMotion,
        state: TrialState,
        proof: ContactProof,
    ) -> None:
        own = options_of(FollowOptions, task)
        speed_m_s = own.speed_mm_s * 1e-3
        self._measurement, self._motion, self._state = measurement, motion, state
        self._across = PositionControl(control.position_gain_per_s, speed_m_s, PERIOD_S)
        # A sensor that has died lets the tool run no faster, until a watch or the next lift finds it.
        self._along = _press(task, control, measurement, _YIELD_M_S)
        self._lift = LiftCheck(state, measurement, motion, proof)
        self._press_N = task.press_kgf * N_PER_KGF
        self._end_m, self._way_m = 0.5e-3 * own.stroke_mm, own.way_mm * 1e-3
        self._lead, self._relief_m, self._tolerance_N = own.lead_ahead, own.relief_mm * 1e-3, own.tolerance_N
        self._time_limit_s, self._proof = task.time_limit_s, proof

    def enter(self) -> None:
        """The surface was touched: press, lift to prove it, and go."""
        self._begun, self._heading, self._gone_m, self._slope = self._state.tick, 1.0, 0.0, 0.0
        self._square_sum, self._ticks, self._worst_N = 0.0, 0, 0.0
        self._lift.running = self._lifted = False

    @property
    def normal_force_N(self) -> float:
        """Force of the surface on the tool along the surface's normal; positive while pressing."""
        x, _, z = self._measurement.force_N
        return (self._slope * x - z) / sqrt(1.0 + self._slope * self._slope)

    @override
    def step(self) -> Vector3:
        """On along the surface; or a lift."""
        state, reference_m = self._state, self._motion.reference_m
        pressed_N = self.normal_force_N
        depth_m = self._measurement.tip_depth_m
        state.report.exploration_time_s = (state.tick - self._begun) * PERIOD_S
        if not -self._relief_m <= depth_m <= self._relief_m:
            state.doubt(self._astray(depth_m))
            return STILL
        if state.report.exploration_time_s >= self._time_limit_s:
            state.end(Outcome.TIME_LIMIT, f"{self._time_limit_s:g} s, {self._gone_m:.3f} m on the way")
            return STILL
        if not self._lifted:
            return self._prove(pressed_N)
        error_N = pressed_N - self._press_N
        self._square_sum, self._ticks = self._square_sum + error_N * error_N, self._ticks + 1
        self._worst_N = max(self._worst_N, abs(error_N))
        target_m = self._heading * self._end_m, 0.0, reference_m[2]
        vx, vy, _ = self._across.velocity_m_s(reference_m, target_m, self._measurement.force_N)
        yielding = self._along.velocity_m_s(reference_m, reference_m, (0.0, 0.0, -pressed_N))[2]
        vz = yielding + self._lead * self._slope * vx
        self._gone_m += abs(vx) * PERIOD_S
        if abs(vx) > 0.0:
            slope = min(max(vz / vx, -_STEEPEST), _STEEPEST)
            self._slope += _SLOPE_SHARE * (slope - self._slope)
        if self._gone_m >= self._way_m:
            self._end()
        elif abs(target_m[0] - reference_m[0]) < _ARRIVED_M:
            self._heading = -self._heading
            self._lifted = False
        return vx, vy, vz

    def _prove(self, pressed_N: float) -> Vector3:
        """At rest: press, and lift a little to see that the force follows."""
        reference_m = self._motion.reference_m
        if not self._lift.running:
            yielding = self._along.velocity_m_s(reference_m, reference_m, (0.0, 0.0, -pressed_N))[2]
            if -self._measurement.filtered_force_z_N < 0.9 * self._press_N:
                return 0.0, 0.0, yielding
            self._lift.begin()
        along = self._lift.velocity_m_s()
        if along is None and self._proof.axial.passed:
            self._state.event("proof", f"lift: {self._proof.axial.share:.2f} of the gripper's stiffness")
            self._lifted = True
        return 0.0, 0.0, along or 0.0

    def _end(self) -> None:
        rms_N = sqrt(self._square_sum / self._ticks)
        told = f"{self._gone_m:.3f} m, {rms_N:.3f} N RMS and {self._worst_N:.2f} N at most from {self._press_N:.3f} N"
        within = rms_N <= self._tolerance_N
        self._state.end(Outcome.DONE if within else Outcome.OUT_OF_TOLERANCE, told)

    def _astray(self, depth_m: float) -> Trip:
        text = (
            f"the tip is at {depth_m * 1e3:.2f} mm, the surface within {self._relief_m * 1e3:g} mm of the nominal"
            " plane: the surface is elsewhere, or the force sensor does not show what there is"
        )
        return Trip(TripReason.PLATE_NOT_FELT, self._state.tick, text)
