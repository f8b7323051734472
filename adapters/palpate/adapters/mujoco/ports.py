"""The four ports to the simulated work cell. Time is simulated, and sleeping advances the simulation."""

from typing import Final

from typing_extensions import override

from palpate.core.errors import CommandError
from palpate.core.ports import (
    CONTROL_RATE_HZ,
    AppliedCommand,
    ArmCommand,
    Clock,
    CommandLimiter,
    CommandReason,
    ForceSensor,
    JointCommand,
    JointEncoder,
    JointSample,
    JointVector,
    Life,
    ManagedDevice,
    WrenchSample,
)
from palpate.simulation.work_cell import WorkCell

_NS: Final = 1_000_000_000
# Looking up an enumeration member is slower.
_ACTIVE: Final = Life.ACTIVE


class MujocoClock(Clock):
    """Exact simulated time. Tick k is at k / 140 s, rounded down to whole nanoseconds."""

    def __init__(self, cell: WorkCell) -> None:
        self._cell = cell

    def now_ns(self) -> int:
        """Return the time of the latest control tick."""
        return self._cell.time_ns

    def sleep_until(self, deadline_ns: int) -> None:
        """Advance the physics by whole control ticks until the deadline is reached."""
        cell = self._cell
        while cell.time_ns < deadline_ns:
            cell.advance()


class MujocoForceSensor(ManagedDevice, ForceSensor):
    """Wrist sensor. It samples at the last physics step of a tick, so the source time is one step before the tick."""

    def __init__(self, cell: WorkCell) -> None:
        super().__init__("simulated force sensor")
        self._cell = cell
        self._age_ns = _NS // (CONTROL_RATE_HZ * cell.config.substeps)
        self._sample: WrenchSample | None = None

    @override
    def read(self) -> WrenchSample:
        if self._life is not _ACTIVE:
            self._require_active("read()")
        now, tick = self._cell.time_ns, self._cell.ticks
        if self._sample is None or self._sample.sequence != tick:
            fx, fy, fz, tx, ty, tz = self._cell.measure_wrench()
            source_ns = now - self._age_ns
            self._sample = WrenchSample((fx, fy, fz), (tx, ty, tz), source_ns if source_ns > 0 else 0, now, tick)
        return self._sample

    def _on_deactivate(self) -> None:
        self._sample = None


class MujocoJointEncoder(ManagedDevice, JointEncoder):
    """Joint encoders with the arm's resolution."""

    def __init__(self, cell: WorkCell) -> None:
        super().__init__("simulated encoders")
        self._cell = cell

    @override
    def read(self) -> JointSample:
        if self._life is not _ACTIVE:
            self._require_active("read()")
        now = self._cell.time_ns
        return JointSample(self._cell.measure_joints(), now, now, self._cell.ticks)


class MujocoArm(ManagedDevice, ArmCommand):
    """Joint servos, which apply the arm's velocity limits and then its position limits, (n,) each."""

    def __init__(
        self,
        cell: WorkCell,
        lower_rad: JointVector,
        upper_rad: JointVector,
        velocity_limit_rad_s: JointVector,
    ) -> None:
        super().__init__("simulated arm")
        self._cell = cell
        self._limiter = CommandLimiter(lower_rad, upper_rad, velocity_limit_rad_s, CONTROL_RATE_HZ)
        self._held: JointVector = ()
        self._stopped = False

    @override
    def send(self, command: JointCommand) -> AppliedCommand:
        if self._life is not _ACTIVE:
            self._require_active("send()")
        requested, stopped = command.position_rad, self._stopped
        if len(requested) != self._limiter.joints:
            raise CommandError(
                f"the arm has {self._limiter.joints} joints, the command has another number", len(requested)
            )
        if stopped:
            return AppliedCommand(self._held, CommandReason.STOPPED)
        applied = self._limiter.limited(requested, self._cell.time_ns)
        self._held = applied.position_rad
        self._cell.command(applied.position_rad)
        if self._stopped:  # meanwhile, by a signal handler or another thread
            self._hold_here()
        return applied

    def stop(self) -> None:
        """Stop the arm, which then holds its position."""
        if self._life in (Life.ACTIVE, Life.FAULTED) and not self._stopped:
            self._stopped = True
            self._hold_here()

    def _hold_here(self) -> None:
        self._held = self._cell.joint_angles()
        self._cell.command(self._held)

    def _on_activate(self) -> None:
        self._stopped = False
        self._hold_here()
        self._limiter.start(self._held)

    def _on_deactivate(self) -> None:
        self._hold_here()

    def _on_close(self) -> None:
        self._hold_here()
