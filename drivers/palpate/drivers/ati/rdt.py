"""RDT, ATI's stream of force/torque records over UDP: bytes to records, and what a status word says."""

import enum
import struct
from dataclasses import dataclass
from typing import Final

from palpate.drivers.errors import RefusedError

RDT_PORT: Final = 49152
_REQUEST: Final = struct.Struct(">HHI")
_RECORD: Final = struct.Struct(">3I6i")
_HEADER: Final = 0x1234
_MOST: Final = 0xFFFF_FFFF
_NEAR: Final = 0x1000
"""So far ahead a number still makes sense in either order."""


class RdtCommand(enum.IntEnum):
    """What a request asks for."""

    STOP = 0
    REAL_TIME = 2


@dataclass(frozen=True, slots=True)
class RdtRecord:
    """One record.

    Attributes:
        rdt_sequence: Counts the records of this stream, 32 bits.
        ft_sequence: Counts the box's own samples, 32 bits.
        counts: Fx, Fy, Fz, Tx, Ty, Tz in counts.
    """

    rdt_sequence: int
    ft_sequence: int
    status: int
    counts: tuple[int, ...]


def encode_request(command: RdtCommand, count: int = 0) -> bytes:
    """A request; a count of 0 is a stream without end."""
    if not 0 <= count <= _MOST:
        raise RefusedError("ATI Net F/T", f"{count} records cannot be asked for", f"0 to {_MOST}")
    return _REQUEST.pack(_HEADER, command, count)


def decode_records(datagram: bytes) -> list[RdtRecord]:
    """The records of a datagram, one or several; none when it is no whole number of records."""
    if len(datagram) % _RECORD.size:
        return []
    return [RdtRecord(r, f, s, tuple(counts)) for r, f, s, *counts in _RECORD.iter_unpack(datagram)]


def is_turned(record: RdtRecord, newest: int | None) -> bool:
    """Whether its numbers make sense in the other byte order alone.

    Args:
        newest: Number of the newest record of this stream; None before its first, which is near zero.
    """
    before = 0 if newest is None else newest
    read, turned = ((n - before) % (_MOST + 1) for n in (record.rdt_sequence, _turned(record.rdt_sequence)))
    return read > _NEAR and 0 < turned <= _NEAR


def _turned(word: int) -> int:
    return int.from_bytes(word.to_bytes(4, "little"), "big")


SATURATED: Final = 1 << 17
_SUMMARY: Final = 1 << 31
_NO_FAULT: Final = SATURATED | 1 << 16
"""Saturation marks samples; a threshold of the box's own monitor was crossed, which is nobody's fault."""

_BITS: Final = {
    30: "CPU or RAM error",
    29: "digital board error",
    28: "analog board error",
    27: "serial link to the analog board failed",
    26: "program memory does not verify",
    25: "halted by a configuration error",
    24: "settings do not validate",
    23: "configuration does not fit the calibration",
    22: "network communication failure",
    21: "CAN communication error",
    20: "RDT communication error",
    19: "EtherNet/IP failure",
    18: "DeviceNet failure",
    14: "watchdog time-out",
    13: "stack check error",
    12: "EEPROM (I2C) failure",
    11: "flash (SPI) failure",
    10: "analog board watchdog time-out",
    9: "strain gauge excitation current too high",
    8: "strain gauge excitation current too low",
    7: "analog ground out of range",
    6: "analog supply voltage too high",
    5: "analog supply voltage too low",
    4: "no data from the serial link: transducer unplugged",
    3: "reference voltage or power monitor error",
    2: "temperature error",
    1: "HTTP failure",
}


def faults_in(status: int) -> tuple[str, ...]:
    """Names of the faults in a status word, the gravest first; empty when there is none."""
    bits = [bit for bit in range(30, -1, -1) if status & ~_NO_FAULT & 1 << bit]
    named = tuple(f"{_BITS.get(bit, 'unknown fault')} (bit {bit})" for bit in bits)
    alone = status & _SUMMARY and not status & _NO_FAULT
    return named or (("an error that it does not name (bit 31)",) if alone else ())
