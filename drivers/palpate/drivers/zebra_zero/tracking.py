"""Scan of all axes, with checks on replies, set-points and faults."""

from collections.abc import Callable, Sequence
from contextlib import suppress

from palpate.drivers.errors import DriverError, GarbledError
from palpate.drivers.nmc import ERRORS_IN_A_ROW, NOP, Aux, NmcBus, NmcCommand, NmcStatus, Reply
from palpate.drivers.zebra_zero.codec import DEVICE, JOINTS, Six, SixCounts
from palpate.drivers.zebra_zero.faults import ArmFaultError, FaultKind, fault_in
from palpate.drivers.zebra_zero.servos import AXES, Servos
from palpate.drivers.zebra_zero.settings import (
    ERROR_LIMIT_COUNTS,
    LIMIT_TOLERANCE_RAD,
    STORED_TOLERANCE_COUNTS,
    ZebraZeroSettings,
)


class Tracking:
    """Filter that accepts only plausible replies.

    A reply from another axis, or a corrupted one with a valid checksum, appears as an impossible jump in a motor's
    position: more than twice the motion at the maximum velocity, plus the position error at which the firmware switches
    off. It is not detected if another axis happens to be at that position.
    """

    def __init__(self, settings: ZebraZeroSettings) -> None:
        self._transmission = settings.transmission
        self._slack_counts = ERROR_LIMIT_COUNTS
        rates = settings.transmission.motor_rates((settings.limits.velocity_rad_per_s,) * JOINTS)
        self._jump_counts_per_s = tuple(2.0 * rate for rate in rates)
        self._counts = [0] * JOINTS
        self._time_ns: list[int | None] = [None] * JOINTS
        self._status = [NmcStatus(0)] * JOINTS
        self._aux: list[Aux | None] = [None] * JOINTS
        self._misses = [0] * JOINTS

    @property
    def counts(self) -> SixCounts:
        """Latest counter values."""
        return tuple(self._counts)

    @property
    def position_rad(self) -> Six:
        """Latest joint angles."""
        return self._transmission.to_rad(self._counts)

    @property
    def replies(self) -> dict[int, Reply]:
        """Latest status from each axis that has replied."""
        news = zip(AXES, self._status, self._aux, self._time_ns, strict=True)
        return {axis: Reply(status=status, aux=aux) for axis, status, aux, time_ns in news if time_ns is not None}

    def agrees(self, stored_counts: Sequence[int]) -> bool:
        """Return True if the counters agree with those of an earlier run."""
        if len(stored_counts) != JOINTS:
            return False
        pairs = zip(self._counts, stored_counts, strict=True)
        return all(abs(a - b) <= STORED_TOLERANCE_COUNTS for a, b in pairs)

    def begin_at(self, counts: SixCounts) -> None:
        """Restart at these counts, whose measurement time is unknown."""
        self._counts = list(counts)
        self._time_ns = [None] * JOINTS
        self._misses = [0] * JOINTS

    def take(self, axis: int, reply: Reply, now_ns: int, *, is_driven: bool) -> int:
        """Accept a reply unless its position is impossible; return 0, or the number of consecutive rejections."""
        index, counts = axis - 1, reply.position_counts
        if counts is None:
            return self._mismatch(index)
        last_ns = self._time_ns[index]
        if is_driven and last_ns is not None:
            reach = self._jump_counts_per_s[index] * (now_ns - last_ns) * 1e-9
            jump = abs(counts - self._counts[index]) - reach
            others = (place for other, place in enumerate(self._counts) if other != index)
            is_other = jump > 0.0 and any(abs(counts - place) <= reach for place in others)
            if is_other or jump > self._slack_counts:
                return self._mismatch(index)
        self._counts[index], self._time_ns[index] = counts, now_ns
        self._status[index], self._aux[index] = reply.status, reply.aux
        self._misses[index] = 0
        return 0

    def _mismatch(self, index: int) -> int:
        self._misses[index] += 1
        return self._misses[index]


class Rounds:
    """Rounds of exchanges with all axes in turn."""

    def __init__(
        self,
        bus: NmcBus,
        servos: Servos,
        tracking: Tracking,
        settings: ZebraZeroSettings,
        clock_ns: Callable[[], int],
    ) -> None:
        self._bus, self._servos, self._tracking = bus, servos, tracking
        self._settings, self._clock_ns = settings, clock_ns

    def run(self, commands: tuple[NmcCommand, ...]) -> None:
        """Run one exchange with each axis, in order.

        Raises:
            DriverError: A fault occurred, or the bus failed.
        """
        for axis, command in zip(AXES, commands, strict=True):
            self._visit(axis, command)
        # This check also runs if the axis did not reply, because the other axes may be outside their limits.
        fault = self.beyond_limits() if self._servos.on else None
        if fault is not None:
            raise fault

    def look_once(self) -> None:
        """Read all axis positions once; skip axes that do not reply."""
        with suppress(DriverError):
            for axis in AXES:
                reply = self._bus.attempt(axis, NOP)
                if isinstance(reply, Reply):
                    self._tracking.take(axis, reply, self._clock_ns(), is_driven=axis in self._servos.on)

    def beyond_limits(self) -> ArmFaultError | None:
        """Return a fault if the latest pose is outside the limits; otherwise None."""
        position = self._tracking.position_rad
        joint = self._settings.limits.outside(position, LIMIT_TOLERANCE_RAD)
        if joint is None:
            return None
        return ArmFaultError(FaultKind.OUT_OF_LIMITS, None, f"joint {joint + 1} at {position[joint]:.4f} rad")

    def _visit(self, axis: int, command: NmcCommand) -> None:
        reply = self._bus.exchange(axis, command)
        if reply is None:
            return
        is_on = axis in self._servos.on
        misses = self._tracking.take(axis, reply, self._clock_ns(), is_driven=is_on)
        if misses >= ERRORS_IN_A_ROW:
            problem = f"motor {axis} reports a position that it cannot have reached"
            raise GarbledError(DEVICE, problem, "check the cable, and that nothing else talks on the bus")
        if misses:
            self._bus.disown(axis)
            return
        fault = fault_in(axis, reply, self._settings, should_be_on=True) if is_on else None
        if fault is not None:
            raise fault
