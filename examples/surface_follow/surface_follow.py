"""A task in a separate package: slide along an unknown surface while pressing along its normal with a constant force.

pip install examples/surface_follow
palpate run --task surface-follow --trials 3 --out runs/follow
palpate replay runs/follow

The tool moves straight down to the first contact, then back and forth along x. While the force is constant, so is the
deflection of the gripper springs, and the flange moves like the tip. The surface slope is therefore that of the
commanded path, averaged over about ten ticks. A damping controller with slope feedforward regulates the normal force.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from math import sqrt
from typing import Annotated, Any, ClassVar, Final

from typing_extensions import override

from palpate.core.motion import ArmDescription, DampingControl, PositionControl, TipMotion, ToolGeometry
from palpate.core.ports import PERIOD_S, ZERO_VELOCITY, GroundTruth, Range, Settings, Vector3
from palpate.core.tasks.contact import ContactTask, Monitor, RunningPhase, TrialState
from palpate.core.trial import (
    N_PER_KGF,
    ControlConfig,
    Fit,
    Measurement,
    Outcome,
    Phase,
    ReadyPose,
    TaskConfig,
    TaskKind,
    TaskParts,
    TrialReport,
    TrialSetup,
    Trip,
    TripReason,
    Workspace,
    find_ready_pose,
    options_of,
)

_APPROACH_M_S: Final = 0.008
_YIELD_M_S: Final = 0.01
"""Maximum speed along the normal, which limits the effect of a dead sensor until the next lift."""
_SETTLE_TICKS: Final = 28
"""Number of ticks after a dither until the pressing force is steady again."""
_ARRIVED_M: Final = 5e-5
_SLOPE_SHARE: Final = 0.1
"""Weight of the latest tick in the slope, which is averaged over about ten ticks."""
_STEEPEST: Final = 1.0


@dataclass(frozen=True)
class FollowOptions(Settings):
    """Settings of this task, which are set with `--task.options NAME VALUE`. Each has a range and a default."""

    TABLE: ClassVar[str] = "task.options"

    stroke_mm: Annotated[float, Range(1.0, 1000.0)] = 100.0
    """Distance between the turning points along x, centred at the nominal goal."""
    way_mm: Annotated[float, Range(1.0, 100_000.0)] = 1000.0
    """Length of the whole path."""
    speed_mm_s: Annotated[float, Range(0.1, 100.0)] = 20.0
    """Speed along x."""
    lead_ahead: Annotated[float, Range(0.0, 1.0)] = 1.0
    """Fraction of the slope that is fed forward; 0 uses only the damping controller."""
    relief_mm: Annotated[float, Range(0.1, 50.0)] = 8.0
    """Maximum distance of the surface from the nominal plane. A larger distance is reported as a contact mismatch."""
    tolerance_N: Annotated[float, Range(0.01, 100.0)] = 0.5
    """Maximum root-mean-square force error."""


class FollowPhase(Enum):
    """Names of the phases of this task, which appear in the events of the log."""

    FOLLOW = "follow"


class FollowTask(ContactTask):
    """Task whose base class lifts, moves to the start, tares and enforces limits. `_follow` adds the other phases."""

    def __init__(self, task: TaskConfig, control: ControlConfig, measurement: Measurement, motion: TipMotion) -> None:
        free = PositionControl(control.position_gain_per_s, task.travel_speed_mm_s * 1e-3, PERIOD_S)
        state = TrialState()
        monitor = Monitor(state, task, control, measurement.depth_step_m)
        super().__init__(task, measurement, motion, free, state, monitor)
        self._approach = ContourApproach(task, control, measurement, motion, state, monitor)
        self._follow_way = Follow(task, control, measurement, motion, state, monitor)

    @override
    def begin(self, setup: TrialSetup) -> None:
        super().begin(setup)
        self._approach.over = False

    @override
    def _follow(self) -> None:
        """Enter the phase that follows the completed one."""
        if self._state.phase is Phase.SETTLE:
            self._enter(Phase.APPROACH, self._approach)
        else:
            self._follow_way.enter()
            self._enter(FollowPhase.FOLLOW, self._follow_way)


def _press(task: TaskConfig, control: ControlConfig, measurement: Measurement, speed_m_s: float) -> DampingControl:
    """Create the controller along the normal. A pressing force has a negative z component."""
    pressing = (0.0, 0.0, -task.press_kgf * N_PER_KGF)
    return DampingControl(control.damping_N_s_per_m, pressing, speed_m_s, measurement.axial_N_per_m, PERIOD_S)


class ContourApproach(RunningPhase):
    """Phase that moves the tool straight down to the first contact."""

    def __init__(
        self,
        task: TaskConfig,
        control: ControlConfig,
        measurement: Measurement,
        motion: TipMotion,
        state: TrialState,
        monitor: Monitor,
    ) -> None:
        self._measurement, self._motion, self._state, self._monitor = measurement, motion, state, monitor
        self._controller = _press(task, control, measurement, _APPROACH_M_S)
        self._contact_N = task.contact_kgf * N_PER_KGF
        # Compared with the commanded depth, so that the search also ends for an arm that does not follow.
        self._deepest_m = options_of(FollowOptions, task).relief_mm * 1e-3

    @override
    def step(self) -> Vector3:
        measured, reference_m = self._measurement, self._motion.reference_m
        # The relief bounds how far the tool may press on what the force does not show.
        self._monitor.free()
        if measured.filtered_force_z_N < -self._contact_N:
            self._state.event("contact", f"surface at {measured.position_m[2] * 1e3:.3f} mm below the nominal plate")
            self.over = True
        elif reference_m[2] > self._deepest_m:
            self._state.end(Outcome.NO_CONTACT, f"nothing touched down to {reference_m[2] * 1e3:.2f} mm")
        return 0.0, 0.0, self._controller.velocity_m_s(reference_m, reference_m, measured.force_N)[2]


class Follow(RunningPhase):
    """Phase that moves back and forth along x. Before each stroke, a dither verifies that the force responds."""

    over = False

    def __init__(
        self,
        task: TaskConfig,
        control: ControlConfig,
        measurement: Measurement,
        motion: TipMotion,
        state: TrialState,
        monitor: Monitor,
    ) -> None:
        own = options_of(FollowOptions, task)
        speed_m_s = own.speed_mm_s * 1e-3
        self._measurement, self._motion, self._state = measurement, motion, state
        self._across = PositionControl(control.position_gain_per_s, speed_m_s, PERIOD_S)
        self._along = _press(task, control, measurement, _YIELD_M_S)
        self._press_N = task.press_kgf * N_PER_KGF
        self._end_m, self._way_m = 0.5e-3 * own.stroke_mm, own.way_mm * 1e-3
        self._lead, self._relief_m, self._tolerance_N = own.lead_ahead, own.relief_mm * 1e-3, own.tolerance_N
        self._time_limit_s, self._monitor = task.time_limit_s, monitor

    def enter(self) -> None:
        """Begin after the first contact."""
        self._begun, self._heading, self._gone_m, self._slope = self._state.tick, 1.0, 0.0, 0.0
        self._square_sum, self._ticks, self._worst_N = 0.0, 0, 0.0
        self._verified = self._dithers = False
        self._settles = 0

    @property
    def normal_force_N(self) -> float:
        """Return the force on the tool along the surface normal, which is positive while pressing."""
        x, _, z = self._measurement.force_N
        return (self._slope * x - z) / sqrt(1.0 + self._slope * self._slope)

    @override
    def step(self) -> Vector3:
        """Return the velocity along the surface or, during a verification, the verification velocity."""
        state, reference_m = self._state, self._motion.reference_m
        pressed_N = self.normal_force_N
        depth_m = self._measurement.tip_depth_m
        state.report.exploration_time_s = (state.tick - self._begun) * PERIOD_S
        if not -self._relief_m <= depth_m <= self._relief_m:
            state.mismatch(self._astray(depth_m))
            return ZERO_VELOCITY
        if state.report.exploration_time_s >= self._time_limit_s:
            state.end(Outcome.TIME_LIMIT, f"{self._time_limit_s:g} s, {self._gone_m:.3f} m on the way")
            return ZERO_VELOCITY
        if not self._verified:
            return self._verify(pressed_N)
        # Along a stroke the force counts as verified; how far the surface may be is bounded by its relief.
        self._monitor.free()
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
            self._verified = self._dithers = False
        return vx, vy, vz

    def _verify(self, pressed_N: float) -> Vector3:
        """Press in place, then dither until the force responds."""
        reference_m, monitor = self._motion.reference_m, self._monitor
        vz = self._along.velocity_m_s(reference_m, reference_m, (0.0, 0.0, -pressed_N))[2]
        if not self._dithers:
            self._dithers = -self._measurement.filtered_force_z_N >= 0.9 * self._press_N
            monitor.axial.restart()
            return 0.0, 0.0, vz
        if self._settles:
            self._settles -= 1
            self._verified = not self._settles
            return 0.0, 0.0, vz
        monitor.wait("before a stroke", supported=True)
        if monitor.axial.verified_since_restart():
            self._state.event("verified", monitor.axial.text())
            self._settles = _SETTLE_TICKS
        return 0.0, 0.0, vz + monitor.dither_m_s()

    def _end(self) -> None:
        rms_N = sqrt(self._square_sum / self._ticks)
        report = f"{self._gone_m:.3f} m, {rms_N:.3f} N RMS and {self._worst_N:.2f} N at most from {self._press_N:.3f} N"
        within = rms_N <= self._tolerance_N
        self._state.end(Outcome.DONE if within else Outcome.OUT_OF_TOLERANCE, report)

    def _astray(self, depth_m: float) -> Trip:
        text = (
            f"the tip is at {depth_m * 1e3:.2f} mm, the surface within {self._relief_m * 1e3:g} mm of the nominal"
            " plane: the surface is elsewhere, or the force sensor does not show what there is"
        )
        return Trip(TripReason.PLATE_NOT_FOUND, self._state.tick, text)


class SurfaceFollow(TaskKind):
    """The task's implementation of palpate's interface. The entry point refers to the only instance of this class."""

    preset: Mapping[str, Any] = {
        "task": {"goal": {"x_mm": 430.0}, "ready_height_mm": 8.0, "time_limit_s": 120.0},
        "control": {"damping_N_s_per_m": 100.0},
        # Sliding with friction chatters at coarser steps of physics: 0.55 N RMS at 4, 0.20 at 16, 0.16 at 32.
        "cell": {
            "contacts": "searched",
            "substeps": 16,
            "hole_uncertainty_mm": 40.0,
            "contour": {"shape": "sine"},
        },
    }
    queries_policy = False
    options = FollowOptions

    @override
    def workspace(self, task: TaskConfig) -> Workspace:
        own = options_of(FollowOptions, task)
        return Workspace((0.5 * own.stroke_mm, 0.0), task.ready_height_mm, own.relief_mm)

    @override
    def ready(self, arm: str | ArmDescription, tool: ToolGeometry, task: TaskConfig) -> ReadyPose:
        return find_ready_pose(arm, tool, task, self.workspace(task))

    @override
    def setup(self, task: TaskConfig, seed: int, trial: int) -> TrialSetup:
        return TrialSetup(trial, seed, (-0.5e-3 * options_of(FollowOptions, task).stroke_mm, 0.0))

    @override
    def make(self, parts: TaskParts) -> FollowTask:
        return FollowTask(parts.task, parts.control, parts.measurement, parts.motion)

    @override
    def achieved(self, task: TaskConfig, report: TrialReport, truth: GroundTruth, fit: Fit) -> bool:
        """Return True if the whole path was within the tolerance and the true peak force was below the limit."""
        return report.outcome is Outcome.DONE and truth.peak_force_N < task.max_force_N


SURFACE_FOLLOW: Final = SurfaceFollow()
