"""The supervisor between task and arm, which passes or clamps each tick's command, or trips."""

from math import isfinite, pi
from operator import sub
from typing import Final

from palpate.core.errors import CommandError, DeviceError, LifecycleError
from palpate.core.motion import Kinematics
from palpate.core.ports import (
    CONTROL_RATE_HZ,
    AppliedCommand,
    CommandReason,
    FaultLatch,
    JointCommand,
    JointVector,
    SensorFacts,
    Snapshot,
    StepLimiter,
    Vector3,
)
from palpate.core.supervision.config import SupervisionConfig
from palpate.core.supervision.monitors import JointMonitor, SampleMonitor, WorkspaceMonitor, WrenchMonitor, require_raw
from palpate.core.supervision.noise_monitor import NoiseMonitor
from palpate.core.supervision.retreat import Retreat
from palpate.core.trial import (
    CommandOverride,
    PhaseConstraints,
    Supervised,
    TaskConfig,
    Trip,
    TripReason,
    Workspace,
    require_place,
)

_NAME = "supervisor"
_PERIOD_S: Final = 1.0 / CONTROL_RATE_HZ
_PULLS: Final = 4
"""Number of consecutive samples with a pull that end a retraction; a single one may be a spike."""


class Supervisor:
    """Supervisor for one arm, trial by trial. It depends only on the snapshots so far, without I/O or a clock.

    Commands beyond a joint limit are clamped. A violation that must end the trial causes a trip: the cause is latched,
    the tool is retracted or held, and the next trial requires a person's acknowledgement at the latch.

    Args:
        config: The limits; :func:`~palpate.core.supervision.fit.require_fitting` checks them for this arm.
        task: Task settings, for the number of samples averaged for taring.
        sensor: Facts about the force sensor. Its samples must contain the declared noise.
        scale: The task's scale factors for the sensor's six channels after taring, (6,).
        axial_N_per_m: Gripper stiffness along the tool axis, which limits the retraction.
        latch: The rig's latch; None creates a new one.
        ready_rad: The ready pose, (n,); each joint must be within half a turn of it at the start of a trial. None if
            unknown.

    Attributes:
        retracting: True while the retraction is not complete.
    """

    def __init__(
        self,
        config: SupervisionConfig,
        task: TaskConfig,
        workspace: Workspace,
        kinematics: Kinematics,
        sensor: SensorFacts,
        scale: tuple[float, ...],
        axial_N_per_m: float,
        latch: FaultLatch | None = None,
        ready_rad: JointVector | None = None,
    ) -> None:
        lower: JointVector = tuple(kinematics.lower_rad.tolist())
        upper: JointVector = tuple(kinematics.upper_rad.tolist())
        velocity: JointVector = tuple(kinematics.velocity_limit_rad_s.tolist())
        self.latch, self._ready_rad = FaultLatch() if latch is None else latch, ready_rad
        self._samples, self._wrench = SampleMonitor(config, sensor), WrenchMonitor(config, scale)
        self._noise = NoiseMonitor(config, task, sensor) if sensor.noise_N > 0.0 or sensor.noise_Nm > 0.0 else None
        self._frame = sensor.frame
        self._joints, self._places = JointMonitor(config, lower, upper, velocity), WorkspaceMonitor(config, workspace)
        self._limiter = StepLimiter(lower, upper, velocity)
        # A peg that was pressed and is stuck is pulled by at most the force limit, even if the sensor does not show it.
        stretch_m = (task.max_force_N + task.insertion_press_N) / axial_N_per_m
        distance_m = min(config.retract_mm * 1e-3, stretch_m)
        self._retreat = Retreat(kinematics, distance_m, config.retract_speed_mm_s * 1e-3, _PERIOD_S)
        self._lower, self._upper, self._count = lower, upper, len(lower)
        self._jump_rad, self._most_pull_N = config.max_command_jump_mrad * 1e-3, task.max_force_N
        self._retracts = config.on_trip == "retract"
        self._active = self.retracting = False
        self._trip: Trip | None = None
        self._held: JointVector
        self._pulls: int

    @property
    def trip(self) -> Trip | None:
        """Return the trip that ended the latest trial, or None if there was none."""
        return self._trip

    def begin(self) -> None:
        """Reset the state for a trial; the next :meth:`check` is its first tick.

        Raises:
            FaultLatchedError: A trip, even from a different supervisor on the same rig, has not been acknowledged.
        """
        self.latch.require_free()
        # An exception may have ended a retraction early.
        self._active, self.retracting = True, False
        self._trip = None
        for monitor in (self._samples, self._wrench, self._joints):
            monitor.begin()
        if self._noise is not None:
            self._noise.begin()
        self._held = ()

    def check(
        self,
        snapshot: Snapshot,
        requested: JointCommand,
        constraints: PhaseConstraints,
        tip_m: Vector3 | None = None,
        turned_rad: tuple[float, float] = (0.0, 0.0),
    ) -> Supervised:
        """Return the arm's command for the current tick; after a trip, the task's command is ignored.

        Args:
            tip_m: Tip position from the encoders, (3,), task frame; None before the task has computed it.
            turned_rad: Tool tilt and yaw from the encoders, (2,).

        Raises:
            LifecycleError: No trial has begun.
            DeviceError: At the beginning of the trial, the arm's pose is unknown, or the wrenches have the wrong frame
                or kind; nothing has been commanded.
            CommandError: The number of joints differs from the arm's.
        """
        if not self._active:
            return self.retreat(snapshot)
        position = requested.position_rad
        if len(position) != self._count:
            raise CommandError(f"a command for {self._count} joints is required", position)
        applied, sound = snapshot.applied, True
        if not self._held:
            self._take_over(snapshot)
        elif applied is not None and applied.reason is not CommandReason.AS_REQUESTED:
            sound = self._adopted(applied)
        trip = self._samples.trip(snapshot)
        if trip is None:
            trip = self._wrench.trip(snapshot, constraints)
        if trip is None and self._noise is not None:
            trip = self._noise.trip(snapshot, constraints)
        if trip is None:
            trip = self._joints.trip(snapshot, self._held)
        if trip is None and tip_m is not None:
            trip = self._places.trip(snapshot.tick, tip_m, constraints, turned_rad)
        if trip is None:
            trip = constraints.mismatch
        if trip is None and not sound and applied is not None:
            bad = sum(not isfinite(q) for q in applied.position_rad)
            text = f"the arm reports an applied command with {bad} non-finite joint angles"
            trip = Trip(TripReason.COMMAND_NOT_FINITE, snapshot.tick, text)
        if trip is not None:
            return self._take_command(trip, snapshot, position)
        within, _ = self._limiter.limited(position, self._held, _PERIOD_S)
        if within.reason is CommandReason.AS_REQUESTED:
            self._held = within.position_rad
            return Supervised(requested)
        # A jump always exceeds a limit of the limiter as well, so it is checked only here.
        trip = self._fault_of_command(snapshot.tick, position)
        if trip is not None:
            return self._take_command(trip, snapshot, position)
        self._held = within.position_rad
        return self._instead(within.reason, position, None)

    def retreat(self, snapshot: Snapshot) -> Supervised:
        """Return the next command after a trip; the task provides no command.

        Raises:
            LifecycleError: There was no trip.
        """
        trip = self._trip
        if trip is None:
            raise LifecycleError(
                _NAME, "active" if self._active else "ready", "check() or retreat()", "call begin() first"
            )
        held, applied = self._held, snapshot.applied
        if applied is not None:
            self._adopted(applied)
            if applied.reason is CommandReason.STOPPED:
                self.retracting = False
        self._pulls = self._pulls + 1 if snapshot.wrench.force_N[2] > self._most_pull_N else 0
        if self._pulls == _PULLS:
            # The tool is stuck: continuing would only increase the pull.
            self.retracting = False
        self._go_back()
        return self._instead(trip.reason, held, trip)

    def _take_over(self, snapshot: Snapshot) -> None:
        joints = snapshot.joints
        require_place(joints, self._count)
        for number, (q, ready) in enumerate(zip(joints.position_rad, self._ready_rad or (), strict=False), start=1):
            if abs(q - ready) > pi:
                # Holding this position would be wrong.
                raise DeviceError(
                    "joint encoder",
                    f"joint {number} reads {q:.4f} rad, more than half a turn from the ready pose, {ready:.4f} rad",
                )
        require_raw(snapshot.wrench, self._frame)
        self._held = self._clamped(joints.position_rad)

    def _adopted(self, applied: AppliedCommand) -> bool:
        """Continue from the command that the arm applied; return False if it is not a valid position."""
        position = applied.position_rad
        if len(position) != self._count or not isfinite(sum(position)):
            return False
        self._held = self._clamped(position)
        return True

    def _clamped(self, position_rad: JointVector) -> JointVector:
        return tuple(
            min(max(q, low), high) for q, low, high in zip(position_rad, self._lower, self._upper, strict=True)
        )

    def _fault_of_command(self, tick: int, position: JointVector) -> Trip | None:
        jump = max(map(abs, map(sub, position, self._held)))
        if jump <= self._jump_rad:
            return None
        text = f"a joint's command jumps by {jump * 1e3:.1f} mrad, limit {self._jump_rad * 1e3:g} mrad"
        return Trip(TripReason.COMMAND_JUMP, tick, text)

    def _take_command(self, trip: Trip, snapshot: Snapshot, requested_rad: JointVector) -> Supervised:
        self._trip, self._pulls = trip, 0
        self.latch.set(str(trip))
        self._active, self.retracting = False, self._retracts
        if self._retracts:
            self._retreat.start(self._held)
        self._go_back()
        return self._instead(trip.reason, requested_rad, trip)

    def _go_back(self) -> None:
        if self.retracting:
            self._held = self._clamped(self._retreat.step(self._held))
            self.retracting = not self._retreat.finished

    def _instead(self, reason: CommandReason | TripReason, requested_rad: JointVector, trip: Trip | None) -> Supervised:
        return Supervised(JointCommand(self._held), CommandOverride(reason, requested_rad, self._held, trip))
