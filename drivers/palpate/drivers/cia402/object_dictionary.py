"""The state machine of a CiA 402 drive as the controlling side sees it: one table, read by mask.

FACT (masks, values and controlwords): ``canopen`` 2.4.1, ``profiles/p402.py``. Standard knowledge, CiA 402-2:
which transition a drive makes by itself, and that fault-reset acts on a rising edge of bit 7.
"""

import enum
from collections.abc import Callable
from typing import Final

import can
from canopen.sdo import SdoAbortedError, SdoClient, SdoCommunicationError

from palpate.drivers.errors import DeviceFaultError, SilentError


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


class Controlword(enum.IntEnum):
    """Controlwords (object 0x6040), as sent."""

    DISABLE_VOLTAGE = 0x0000
    QUICK_STOP = 0x0002
    SHUTDOWN = 0x0006
    SWITCH_ON = 0x0007
    ENABLE_OPERATION = 0x000F
    FAULT_RESET = 0x0080


class Status(enum.IntFlag):
    """Bits of the statusword besides those of the state. Standard knowledge, CiA 402-2, modes CSP and CSV."""

    REMOTE = 1 << 9
    INTERNAL_LIMIT = 1 << 11
    FOLLOWS_TARGET = 1 << 12
    FOLLOWING_ERROR = 1 << 13


class OperationMode(enum.IntEnum):
    """Modes of operation (object 0x6060) in which a host may close a loop every cycle."""

    CSP = 8
    CSV = 9


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
"""How a statusword is recognised: state, mask, value, ``word & mask == value``."""

TRANSITIONS: Final[dict[tuple[DriveState, Controlword], DriveState]] = {
    (DriveState.SWITCH_ON_DISABLED, Controlword.SHUTDOWN): DriveState.READY,
    (DriveState.READY, Controlword.SWITCH_ON): DriveState.SWITCHED_ON,
    (DriveState.READY, Controlword.DISABLE_VOLTAGE): DriveState.SWITCH_ON_DISABLED,
    (DriveState.READY, Controlword.QUICK_STOP): DriveState.SWITCH_ON_DISABLED,
    (DriveState.SWITCHED_ON, Controlword.ENABLE_OPERATION): DriveState.ENABLED,
    (DriveState.SWITCHED_ON, Controlword.SHUTDOWN): DriveState.READY,
    (DriveState.SWITCHED_ON, Controlword.DISABLE_VOLTAGE): DriveState.SWITCH_ON_DISABLED,
    (DriveState.SWITCHED_ON, Controlword.QUICK_STOP): DriveState.SWITCH_ON_DISABLED,
    (DriveState.ENABLED, Controlword.SWITCH_ON): DriveState.SWITCHED_ON,
    (DriveState.ENABLED, Controlword.SHUTDOWN): DriveState.READY,
    (DriveState.ENABLED, Controlword.DISABLE_VOLTAGE): DriveState.SWITCH_ON_DISABLED,
    (DriveState.ENABLED, Controlword.QUICK_STOP): DriveState.QUICK_STOP,
    (DriveState.QUICK_STOP, Controlword.DISABLE_VOLTAGE): DriveState.SWITCH_ON_DISABLED,
    (DriveState.FAULT, Controlword.FAULT_RESET): DriveState.SWITCH_ON_DISABLED,
}
"""Transitions that a controlword causes. The optional one from quick stop straight back to enabled is left out:
after a stop an arm shall go the whole way, as after power-up."""


def state_of(statusword: int) -> DriveState | None:
    """The state that a statusword (object 0x6041) means, or None where it fits no pattern."""
    return next((state for state, mask, value in PATTERNS if statusword & mask == value), None)


def command_towards(state: DriveState, goal: DriveState, *, by_operator: bool = False) -> Controlword | None:
    """The controlword to send next, on the shortest way through :data:`TRANSITIONS`.

    Returns:
        None where no controlword helps: one can but wait, or a person has to act.
    """
    first: dict[DriveState, Controlword] = {}
    found = [state]
    for here in found:
        for (start, command), end in TRANSITIONS.items():
            forbidden = command is Controlword.FAULT_RESET and not by_operator
            if start is here and end not in found and not forbidden:
                first[end] = first.get(here, command)
                found.append(end)
    return first.get(goal)


_UNKNOWN: Final = (0x06020000, 0x06090011)
"""Abort codes of an object or a sub-index that does not exist (FACT: ``canopen`` 2.4.1, ``sdo/exceptions.py``)."""


class Objects:
    """The object dictionary of one drive, over the bus."""

    def __init__(self, node: int, channel: SdoClient) -> None:
        self.node = node
        self.name = f"drive {node}"
        self._channel = channel

    def read(self, index: int, subindex: int = 0) -> bytes | None:
        """An object's bytes, or None where the drive has no such object."""
        return self._try(index, subindex, lambda: self._channel.upload(index, subindex))

    def write(self, index: int, subindex: int, value: int, size: int) -> None:
        """Write an integer, little-endian; negative ones in two's complement."""
        if not self.write_if_known(index, subindex, value, size):
            problem = f"has no object 0x{index:04X}:{subindex:02X}"
            raise DeviceFaultError(self.name, problem, "this arm needs a drive that has it")

    def write_if_known(self, index: int, subindex: int, value: int, size: int) -> bool:
        """As :meth:`write`, but False where the drive has no such object."""
        data = (value % (1 << 8 * size)).to_bytes(size, "little")
        return self._try(index, subindex, lambda: self._download(index, subindex, data)) is not None

    def _download(self, index: int, subindex: int, data: bytes) -> bytes:
        self._channel.download(index, subindex, data)
        return data

    def _try(self, index: int, subindex: int, transfer: Callable[[], bytes]) -> bytes | None:
        where = f"object 0x{index:04X}:{subindex:02X}"
        try:
            return transfer()
        except SdoAbortedError as error:
            if error.code in _UNKNOWN:
                return None
            remedy = "see the drive's manual for this abort code"
            raise DeviceFaultError(self.name, f"refuses {where}: {error}", remedy) from error
        except (SdoCommunicationError, can.CanError, OSError, RuntimeError) as error:
            remedy = "check its power, its cable and its node number"
            raise SilentError(self.name, f"does not answer about {where}: {error}", remedy) from error
