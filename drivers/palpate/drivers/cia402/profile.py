"""The state machine of a CiA 402 drive as the controlling side sees it: one table, read by mask.

FACT (masks, values and controlwords): ``canopen`` 2.4.1, ``profiles/p402.py``. Standard knowledge, CiA 402-2:
which transition a drive makes by itself, and that fault-reset acts on a rising edge of bit 7.
"""

from __future__ import annotations

import enum
from dataclasses import dataclass
from typing import Final


class DriveState(enum.Enum):
    """States that a drive reports in its statusword."""

    NOT_READY = "not ready to switch on"
    SWITCH_ON_DISABLED = "switch on disabled"
    READY = "ready to switch on"
    SWITCHED_ON = "switched on"
    ENABLED = "operation enabled"
    QUICK_STOP = "quick stop active"
    FAULT_REACTION = "fault reaction active"
    FAULT = "fault"


class Command(enum.IntEnum):
    """Controlwords (object 0x6040), as sent."""

    DISABLE_VOLTAGE = 0x0000
    QUICK_STOP = 0x0002
    SHUTDOWN = 0x0006
    SWITCH_ON = 0x0007
    ENABLE_OPERATION = 0x000F
    FAULT_RESET = 0x0080


class Mode(enum.IntEnum):
    """Modes of operation (object 0x6060) in which a host may close a loop every cycle."""

    CSP = 8
    CSV = 9


@dataclass(frozen=True, slots=True)
class Pattern:
    """How a statusword is recognised: ``word & mask == value``."""

    state: DriveState
    mask: int
    value: int


PATTERNS: Final = (
    Pattern(DriveState.NOT_READY, 0x4F, 0x00),
    Pattern(DriveState.SWITCH_ON_DISABLED, 0x4F, 0x40),
    Pattern(DriveState.READY, 0x6F, 0x21),
    Pattern(DriveState.SWITCHED_ON, 0x6F, 0x23),
    Pattern(DriveState.ENABLED, 0x6F, 0x27),
    Pattern(DriveState.QUICK_STOP, 0x6F, 0x07),
    Pattern(DriveState.FAULT_REACTION, 0x4F, 0x0F),
    Pattern(DriveState.FAULT, 0x4F, 0x08),
)

TRANSITIONS: Final[dict[tuple[DriveState, Command], DriveState]] = {
    (DriveState.SWITCH_ON_DISABLED, Command.SHUTDOWN): DriveState.READY,
    (DriveState.READY, Command.SWITCH_ON): DriveState.SWITCHED_ON,
    (DriveState.READY, Command.DISABLE_VOLTAGE): DriveState.SWITCH_ON_DISABLED,
    (DriveState.READY, Command.QUICK_STOP): DriveState.SWITCH_ON_DISABLED,
    (DriveState.SWITCHED_ON, Command.ENABLE_OPERATION): DriveState.ENABLED,
    (DriveState.SWITCHED_ON, Command.SHUTDOWN): DriveState.READY,
    (DriveState.SWITCHED_ON, Command.DISABLE_VOLTAGE): DriveState.SWITCH_ON_DISABLED,
    (DriveState.SWITCHED_ON, Command.QUICK_STOP): DriveState.SWITCH_ON_DISABLED,
    (DriveState.ENABLED, Command.SWITCH_ON): DriveState.SWITCHED_ON,
    (DriveState.ENABLED, Command.SHUTDOWN): DriveState.READY,
    (DriveState.ENABLED, Command.DISABLE_VOLTAGE): DriveState.SWITCH_ON_DISABLED,
    (DriveState.ENABLED, Command.QUICK_STOP): DriveState.QUICK_STOP,
    (DriveState.QUICK_STOP, Command.DISABLE_VOLTAGE): DriveState.SWITCH_ON_DISABLED,
    (DriveState.FAULT, Command.FAULT_RESET): DriveState.SWITCH_ON_DISABLED,
}
"""Transitions that a controlword causes. The optional one from quick stop straight back to enabled is left out:
after a stop an arm shall go the whole way, as after power-up."""


def state_of(statusword: int) -> DriveState | None:
    """The state that a statusword (object 0x6041) tells, or None where it fits no pattern."""
    for pattern in PATTERNS:
        if statusword & pattern.mask == pattern.value:
            return pattern.state
    return None


def command_towards(state: DriveState, goal: DriveState, *, by_operator: bool = False) -> Command | None:
    """The controlword to send next, on the shortest way through :data:`TRANSITIONS`.

    Args:
        state: Where the drive is.
        goal: Where it shall be, another state.
        by_operator: A person asked for it; only then does the way lead out of a fault.

    Returns:
        None where no controlword helps: one can but wait, or a person has to act.
    """
    first: dict[DriveState, Command] = {}
    found = [state]
    for here in found:
        for (start, command), end in TRANSITIONS.items():
            forbidden = command is Command.FAULT_RESET and not by_operator
            if start is here and end not in found and not forbidden:
                first[end] = first.get(here, command)
                found.append(end)
    return first.get(goal)
