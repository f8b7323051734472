"""One round over all axes: what is sent, what is believed of the replies, and what is wrong."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass

from palpate.drivers.errors import DriverError, GarbledError
from palpate.drivers.nmc.bus import NmcBus
from palpate.drivers.nmc.commands import NOP
from palpate.drivers.nmc.frames import Command
from palpate.drivers.nmc.replies import Reply
from palpate.drivers.zebra_zero.counts import DEVICE
from palpate.drivers.zebra_zero.faults import Fault, FaultKind, fault_in
from palpate.drivers.zebra_zero.servos import AXES, Servos
from palpate.drivers.zebra_zero.settings import ZebraZeroSettings
from palpate.drivers.zebra_zero.tracking import Tracking


@dataclass(frozen=True, slots=True)
class Trouble:
    """A fault to be latched, and the error that tells it.

    Attributes:
        fault: What to latch.
        error: What to raise.
    """

    fault: Fault
    error: DriverError


def lost(error: DriverError, axis: int | None = None) -> Trouble:
    """The trouble that an error of the bus is."""
    return Trouble(Fault(FaultKind.COMMUNICATION, axis, error.problem), error)


class Rounds:
    """Visits the axes one after the other.

    Args:
        bus: The bus.
        servos: Which of them are on.
        tracking: Where replies go.
        settings: The arm's settings.
        clock_ns: Monotonic clock.
    """

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

    def run(self, commands: tuple[Command, ...]) -> tuple[tuple[bool, ...], Trouble | None]:
        """One exchange with each axis, in their order, until there is trouble.

        Returns:
            Which axes gave news, and the trouble, if any.
        """
        is_fresh = []
        for axis, command in zip(AXES, commands, strict=True):
            is_news, trouble = self._visit(axis, command)
            is_fresh.append(is_news)
            if trouble is not None:
                return tuple(is_fresh), trouble
        # Also when an axis gave no news: the others may be where they must not be.
        fault = self.beyond_limits() if self._servos.on else None
        return tuple(is_fresh), None if fault is None else Trouble(fault, fault.error())

    def look_once(self) -> None:
        """Takes the positions at rest, as far as they are to be had."""
        with suppress(DriverError):
            for axis in AXES:
                reply = self._bus.attempt(axis, NOP)
                if isinstance(reply, Reply):
                    self._tracking.take(axis, reply, self._clock_ns(), is_driven=axis in self._servos.on)

    def beyond_limits(self) -> Fault | None:
        """The fault that the newest pose is, or None."""
        position = self._tracking.position_rad
        joint = self._settings.limits.outside(position, self._settings.limit_tolerance_rad)
        if joint is None:
            return None
        return Fault(FaultKind.OUT_OF_LIMITS, None, f"joint {joint + 1} at {position[joint]:.4f} rad")

    def _visit(self, axis: int, command: Command) -> tuple[bool, Trouble | None]:
        try:
            reply = self._bus.exchange(axis, command)
        except DriverError as error:
            return False, lost(error, axis)
        if reply is None:
            return False, None
        is_on = axis in self._servos.on
        doubts = self._tracking.take(axis, reply, self._clock_ns(), is_driven=is_on)
        if doubts >= self._settings.bus.errors_in_a_row:
            problem = f"motor {axis} reports a position that it cannot have reached"
            remedy = "check the cable, and that nothing else talks on the bus"
            return False, lost(GarbledError(DEVICE, problem, remedy), axis)
        if doubts:
            return False, None
        fault = fault_in(axis, reply, self._settings, should_be_on=True) if is_on else None
        return True, None if fault is None else Trouble(fault, fault.error())
