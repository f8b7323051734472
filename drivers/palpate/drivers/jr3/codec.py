"""Convert between CAN frames and messages, without I/O or a clock.

FACT (README of jr3-mbed-firmware-can): 1 Mbit/s, 11-bit identifiers equal to operation + node, little-endian payloads.
Invalid frames are counted and dropped without an error, because the bus is shared. The controller has already checked
the 15-bit CRC, so a damaged frame either passed that check or was damaged between the controller and the host.
"""

import enum
import struct
from collections import Counter
from typing import NamedTuple

from palpate.drivers.can import CanFrame
from palpate.drivers.jr3.messages import Ack, Bootup, Counts3, Message, Op, Reading


class Jr3Code(enum.IntEnum):
    """Message identifiers for a JR3 board. The node number is added to them."""

    ACK = 0x100
    FORCES = 0x600
    MOMENTS = 0x680
    BOOTUP = 0x700


_NODE_MASK, _OP_MASK = 0x07F, 0x780
_HALF, _SCALES = struct.Struct("<3hH"), struct.Struct("<3H")
_READY, _NOT_INITIALISED = 0, 1
_GARBAGE, _ORPHANS = "frames without sense", "halves of readings without the other half"


def encode_can(op: Op, node: int, cutoff_cHz: int = 0, period_us: int = 0) -> CanFrame:
    """Return the CAN frame for a request.

    FACT (jr3-mbed-firmware-can main.cpp): START contains a 16-bit cut-off followed by a 32-bit period.

    Args:
        cutoff_cHz: Cut-off frequency for the low-pass filter in hundredths of a hertz, 0 for no filter; only for START.
        period_us: Time between readings in microseconds; only for START.
    """
    return CanFrame(op + node, struct.pack("<HI", cutoff_cHz, period_us) if op is Op.START else b"")


class _Half(NamedTuple):
    """Three forces or three moments in counts, and the frame counter, 0 to 65535."""

    counts: Counts3
    counter: int


class CanDecoder:
    """Decoder for one node's frames. It joins the two halves of a reading, which may arrive in either order.

    Args:
        errors: Counters for invalid frames and for halves whose other half is missing.
    """

    def __init__(self, node: int, errors: Counter[str]) -> None:
        self._node, self._errors = node, errors
        self._halves: dict[int, _Half] = {}

    def forget(self) -> None:
        """Drop incomplete readings: after a restart, halves with equal counters may belong to different readings."""
        self._errors[_ORPHANS] += len(self._halves)
        self._halves.clear()

    def decode(self, frame: CanFrame) -> Message | None:
        """Return the message in a frame, or None if it is for another node, invalid, or the first half of a reading."""
        if frame.can_id & _NODE_MASK != self._node:
            return None
        op, data = frame.can_id & _OP_MASK, frame.data
        if op in (Jr3Code.FORCES, Jr3Code.MOMENTS) and len(data) == _HALF.size:
            x, y, z, counter = _HALF.unpack(data)
            return self._joined(op, _Half((x, y, z), counter))
        if op == Jr3Code.ACK and len(data) in (1, 1 + _SCALES.size) and data[0] in (_READY, _NOT_INITIALISED):
            return Ack(data[0] == _READY, _SCALES.unpack_from(data, 1) if len(data) > 1 else ())
        if op == Jr3Code.BOOTUP and not data:
            return Bootup()
        self._errors[_GARBAGE] += op in list(Jr3Code)
        return None

    def _joined(self, op: int, half: _Half) -> Reading | None:
        waiting = self._halves.get(op)
        self._errors[_ORPHANS] += waiting is not None and waiting.counter != half.counter
        self._halves[op] = half
        forces, moments = self._halves.get(Jr3Code.FORCES), self._halves.get(Jr3Code.MOMENTS)
        if forces is None or moments is None or forces.counter != moments.counter:
            return None
        self._halves.clear()
        return Reading((*forces.counts, *moments.counts), half.counter)
