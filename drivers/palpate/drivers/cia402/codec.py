"""Messages between a CiA 402 drive and its host: identifiers, process data, and the state machine as a table.

FACT (masks, values and controlwords): ``canopen`` 2.4.1, ``profiles/p402.py``. Standard knowledge (CiA 301 and CiA
402-2): the predefined connection set, the transitions that a drive makes on its own, and the fault reset on the rising
edge of bit 7.
"""

import enum
import struct
from typing import Final

NMT: Final = 0x000
SYNC: Final = 0x080
EMCY: Final = 0x080
TPDO1: Final = 0x180
RPDO1: Final = 0x200
SDO_ANSWER: Final = 0x580
SDO_REQUEST: Final = 0x600
HEARTBEAT: Final = 0x700
HIGHEST_NODE: Final = 127

NMT_START: Final = 0x01
NMT_PRE_OPERATIONAL: Final = 0x80
NMT_OPERATIONAL: Final = 0x05
"""Value of the operational state in heartbeats."""

RPDO: Final = struct.Struct("<Hi")
"""Layout of the host's process data: controlword (6040) and target position (607A)."""
TPDO: Final = struct.Struct("<Hib")
"""Layout of a drive's process data: 6041, 6064, 6061 (current mode). A drive that loses its mode stops silently."""

CSP: Final = 8
"""Code for the mode "cyclic synchronous position" in object 0x6060."""


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


FAULTS: Final = (DriveState.FAULT, DriveState.FAULT_REACTION)


class Controlword(enum.IntEnum):
    """Controlwords that the host sends (object 0x6040)."""

    DISABLE_VOLTAGE = 0x0000
    QUICK_STOP = 0x0002
    SHUTDOWN = 0x0006
    SWITCH_ON = 0x0007
    ENABLE_OPERATION = 0x000F
    FAULT_RESET = 0x0080


class Status(enum.IntFlag):
    """Bits in the statusword that are not part of the state. Standard knowledge: CiA 402-2, mode CSP."""

    REMOTE = 1 << 9
    FOLLOWING_ERROR = 1 << 13


PATTERNS: Final = (
    (DriveState.NOT_READY, 0x4F, 0x00),
    (DriveState.SWITCH_ON_DISABLED, 0x4F, 0x40),
    (DriveState.READY, 0x6F, 0x21),
    (DriveState.SWITCHED_ON, 0x6F, 0x23),
    (DriveState.ENABLED, 0x6F, 0x27),
    (DriveState.QUICK_STOP, 0x6F, 0x07),
    (DriveState.FAULT_REACTION, 0x4F, 0x0F),
    (DriveState.FAULT, 0x4F, 0x08),
)
"""State, mask and value for each pattern; a statusword matches if ``word & mask == value``."""

_TO_ENABLED: Final = {
    DriveState.SWITCH_ON_DISABLED: Controlword.SHUTDOWN,
    DriveState.READY: Controlword.SWITCH_ON,
    DriveState.SWITCHED_ON: Controlword.ENABLE_OPERATION,
    DriveState.ENABLED: Controlword.ENABLE_OPERATION,
    DriveState.QUICK_STOP: Controlword.DISABLE_VOLTAGE,
}
"""Next controlword on the path to the state "operation enabled". The optional direct transition from quick stop is not
used: after a stop, an arm passes through all states, as after power-up."""


def state_of(statusword: int) -> DriveState | None:
    """Return the state in a statusword (object 0x6041), or None if it matches no pattern."""
    return next((state for state, mask, value in PATTERNS if statusword & mask == value), None)


def command_towards(state: DriveState | None, goal: DriveState, *, by_operator: bool = False) -> Controlword:
    """Return the next controlword towards "operation enabled", or straight to off. Only operators may reset faults."""
    if state is DriveState.FAULT and by_operator:
        return Controlword.FAULT_RESET
    if state is None or goal is not DriveState.ENABLED:
        return Controlword.DISABLE_VOLTAGE
    return _TO_ENABLED.get(state, Controlword.DISABLE_VOLTAGE)
