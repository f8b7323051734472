"""An emulated drive's object dictionary: sizes, access, defaults, and abort codes for rejected accesses.

Standard knowledge: CiA 301 (communication objects, abort codes) and CiA 402-2 (0x6000 and above).
``canopen.sdo.SdoServer`` performs the transfers and uses the dictionary as its node.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from canopen.sdo import SdoAbortedError

ABORT_READ_ONLY: Final = 0x0601_0002
ABORT_NO_OBJECT: Final = 0x0602_0000
ABORT_NOT_MAPPABLE: Final = 0x0604_0041
ABORT_PDO_LENGTH: Final = 0x0604_0042
ABORT_LENGTH: Final = 0x0607_0010
ABORT_NO_SUBINDEX: Final = 0x0609_0011
ABORT_VALUE: Final = 0x0609_0030
ABORT_STATE: Final = 0x0800_0022

PDO_INVALID: Final = 1 << 31
RPDO_SETTINGS: Final = 0x1400
RPDO_MAPPING: Final = 0x1600
TPDO_SETTINGS: Final = 0x1800
TPDO_MAPPING: Final = 0x1A00

CONTROLWORD: Final = 0x6040
STATUSWORD: Final = 0x6041
QUICK_STOP_OPTION: Final = 0x605A
MODE: Final = 0x6060
MODE_SHOWN: Final = 0x6061
POSITION: Final = 0x6064
FOLLOWING_ERROR_WINDOW: Final = 0x6065
TARGET_POSITION: Final = 0x607A
QUICK_STOP_DECELERATION: Final = 0x6085
INTERPOLATION: Final = 0x60C2
HOST_LOST_OPTION: Final = 0x6007
CONSUMER_HEARTBEAT: Final = 0x1016
PRODUCER_HEARTBEAT: Final = 0x1017

_PDOS: Final = 4
_MAPPED: Final = 4
_NO_MODE, CSP = 0, 8
_OFFERS_CSP: Final = 1 << 7


@dataclass(slots=True)
class Entry:
    """An object with its value, in two's complement if signed, and its access rights."""

    value: int
    size: int
    signed: bool = False
    writable: bool = False
    mappable: bool = False

    def encode(self) -> bytes:
        """Return the value as bytes for the bus."""
        return self.value.to_bytes(self.size, "little", signed=self.signed)

    def decode(self, data: bytes) -> None:
        """Set the value from bytes received over the bus."""
        self.value = int.from_bytes(data, "little", signed=self.signed)


class ObjectDictionary:
    """All objects in a drive, with their values after power-up. ``written`` receives each index written via SDO."""

    def __init__(self, node: int, *, serial: int, written: Callable[[int], object]) -> None:
        self.object_dictionary: dict[int, object] = {}
        self._written = written
        self._entries: dict[tuple[int, int], Entry] = {
            (0x1000, 0): Entry(0x0002_0192, 4),
            (0x1001, 0): Entry(0, 1),
            (0x1008, 0): Entry(int.from_bytes(b"EMU1", "little"), 4),
            (CONSUMER_HEARTBEAT, 0): Entry(1, 1),
            (CONSUMER_HEARTBEAT, 1): Entry(0, 4, writable=True),
            (PRODUCER_HEARTBEAT, 0): Entry(0, 2, writable=True),
            (0x1018, 0): Entry(4, 1),
            (0x1018, 1): Entry(0x0000_03E7, 4),
            (0x1018, 2): Entry(0x0000_0402, 4),
            (0x1018, 3): Entry(0x0001_0000, 4),
            (0x1018, 4): Entry(serial, 4),
            (HOST_LOST_OPTION, 0): Entry(0, 2, signed=True, writable=True),
            (CONTROLWORD, 0): Entry(0, 2, writable=True, mappable=True),
            (STATUSWORD, 0): Entry(0, 2, mappable=True),
            (QUICK_STOP_OPTION, 0): Entry(2, 2, signed=True, writable=True),
            (MODE, 0): Entry(0, 1, signed=True, writable=True, mappable=True),
            (MODE_SHOWN, 0): Entry(0, 1, signed=True, mappable=True),
            (POSITION, 0): Entry(0, 4, signed=True, mappable=True),
            (FOLLOWING_ERROR_WINDOW, 0): Entry(20_000, 4, writable=True),
            (TARGET_POSITION, 0): Entry(0, 4, signed=True, writable=True, mappable=True),
            (QUICK_STOP_DECELERATION, 0): Entry(100_000, 4, writable=True),
            (INTERPOLATION, 0): Entry(2, 1),
            (INTERPOLATION, 1): Entry(1, 1, writable=True),
            (INTERPOLATION, 2): Entry(-3, 1, signed=True, writable=True),
            (0x6502, 0): Entry(_OFFERS_CSP, 4),
        }
        for pdo in range(_PDOS):
            # Switched on after power-up, as by many manufacturers.
            self._add_pdo(RPDO_SETTINGS + pdo, 0x200 + 0x100 * pdo + node)
            self._add_pdo(TPDO_SETTINGS + pdo, 0x180 + 0x100 * pdo + node)
        for mapping, mapped in ((RPDO_MAPPING, CONTROLWORD), (TPDO_MAPPING, STATUSWORD)):
            self._entries[mapping, 0] = Entry(1, 1, writable=True)
            for sub in range(1, _MAPPED + 1):
                self._entries[mapping, sub] = Entry(mapped << 16 | 0x10 if sub == 1 else 0, 4, writable=True)

    def __getitem__(self, index: int) -> int:
        return self._entries[index, 0].value

    def __setitem__(self, index: int, value: int) -> None:
        self._entries[index, 0].value = value

    def sub(self, index: int, subindex: int) -> int:
        """Return the value of a sub-index."""
        return self._entries[index, subindex].value

    def entry(self, index: int, subindex: int) -> Entry:
        """Return an object."""
        found = self._entries.get((index, subindex))
        if found is None:
            known = any(i == index for i, _ in self._entries)
            raise SdoAbortedError(ABORT_NO_SUBINDEX if known else ABORT_NO_OBJECT)
        return found

    def get_data(self, index: int, subindex: int, *, check_readable: bool = False) -> bytes:
        """Read an object via SDO. The ``canopen`` library requires this name."""
        return self.entry(index, subindex).encode()

    def set_data(self, index: int, subindex: int, data: bytes, *, check_writable: bool = False) -> None:
        """Write an object via SDO. The ``canopen`` library requires this name."""
        entry = self.entry(index, subindex)
        if not entry.writable:
            raise SdoAbortedError(ABORT_READ_ONLY)
        if len(data) != entry.size:
            raise SdoAbortedError(ABORT_LENGTH)
        value = int.from_bytes(data, "little", signed=entry.signed)
        if index in (RPDO_MAPPING, TPDO_MAPPING):
            self._check_mapping(index, subindex, value)
        if index == MODE and value not in (_NO_MODE, CSP):
            raise SdoAbortedError(ABORT_VALUE)
        entry.decode(data)
        if index == MODE:
            self[MODE_SHOWN] = value
        self._written(index)

    def mapped(self, mapping_index: int) -> list[Entry]:
        """Return the objects that are mapped into a PDO, in order."""
        words = [self.sub(mapping_index, sub) for sub in range(1, self.sub(mapping_index, 0) + 1)]
        return [self._entries[word >> 16, word >> 8 & 0xFF] for word in words]

    def _check_mapping(self, index: int, subindex: int, value: int) -> None:
        settings = index - (RPDO_MAPPING - RPDO_SETTINGS)
        if not self.sub(settings, 1) & PDO_INVALID:
            raise SdoAbortedError(ABORT_STATE)
        if subindex == 0:
            if value > _MAPPED:
                raise SdoAbortedError(ABORT_VALUE)
            if sum(self.sub(index, sub) & 0xFF for sub in range(1, value + 1)) > 64:
                raise SdoAbortedError(ABORT_PDO_LENGTH)
            return
        if self.sub(index, 0) != 0:
            raise SdoAbortedError(ABORT_STATE)
        target = self._entries.get((value >> 16, value >> 8 & 0xFF))
        if target is None or not target.mappable or target.size * 8 != value & 0xFF:
            raise SdoAbortedError(ABORT_NOT_MAPPABLE)

    def _add_pdo(self, settings: int, identifier: int) -> None:
        self._entries |= {
            (settings, 0): Entry(2, 1),
            (settings, 1): Entry(identifier, 4, writable=True),
            (settings, 2): Entry(1, 1, writable=True),
        }
