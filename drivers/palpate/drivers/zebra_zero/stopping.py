"""Bringing motors to rest: it never raises, so that it can stand on every way out."""

from __future__ import annotations

import enum
from collections.abc import Callable, Sequence
from typing import Final

from palpate.drivers.errors import DriverError
from palpate.drivers.nmc.bus import NmcBus
from palpate.drivers.nmc.commands import NOP, stop_motor
from palpate.drivers.nmc.flags import STICKY_STATUS, Status, Stop
from palpate.drivers.nmc.frames import Command
from palpate.drivers.nmc.replies import Reply

SMOOTH: Final = stop_motor(Stop.AMP_ENABLE | Stop.SMOOTH)
ABRUPT: Final = stop_motor(Stop.AMP_ENABLE | Stop.ABRUPT)
_POLL_S: Final = 0.002


class StopOutcome(enum.Enum):
    """What is known after a stop."""

    NOTHING_ON = "no servo was on"
    AT_REST = "every motor was seen at rest"
    NOT_SEEN = "not every motor was seen at rest"
    LINE_DEAD = "no motor could be reached"


def bring_to_rest(
    bus: NmcBus,
    addresses: Sequence[int],
    timeout_s: float,
    clock_ns: Callable[[], int],
    *,
    are_all: bool,
) -> StopOutcome:
    """Stops the motors smoothly with their amplifiers on, and watches until they rest; abruptly after the time-out.

    Args:
        bus: The bus, also while it demands a new start.
        addresses: Modules whose servos are on. One that turns out to have switched itself off is left so: a stop
            might switch it on again.
        timeout_s: Time in which they must be seen at rest.
        clock_ns: Monotonic clock.
        are_all: These are all modules, so that one command to the group can stop them together.
    """
    if not addresses:
        return StopOutcome.NOTHING_ON
    deadline_ns = clock_ns() + round(timeout_s * 1e9)
    told: set[int] = set()
    moving = set(addresses)
    try:
        if are_all:
            bus.group(SMOOTH)
        while moving and clock_ns() < deadline_ns:
            for address in sorted(moving):
                _poll(bus, address, told, moving)
            bus.wait_s(_POLL_S)
        for address in sorted(moving):
            _say(bus, address, ABRUPT)
    except DriverError:
        return StopOutcome.LINE_DEAD
    if not moving:
        return StopOutcome.AT_REST
    return StopOutcome.NOT_SEEN if told else StopOutcome.LINE_DEAD


def _poll(bus: NmcBus, address: int, told: set[int], moving: set[int]) -> None:
    reply = bus.attempt(address, NOP)
    if not isinstance(reply, Reply):
        return
    if reply.status & STICKY_STATUS:
        told.add(address)
        moving.discard(address)
    elif address not in told:
        # The group's command has no receipt, so each module is told once more.
        if isinstance(bus.attempt(address, SMOOTH), Reply):
            told.add(address)
    elif reply.status & Status.MOVE_DONE:
        moving.discard(address)


def _say(bus: NmcBus, address: int, command: Command) -> None:
    # Twice at most: the first may be what the line has damaged.
    if not isinstance(bus.attempt(address, command), Reply):
        bus.attempt(address, command)
