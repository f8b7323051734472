"""CAN frames to messages and back: no input or output, no clock, no state but counters.

FACT (README of jr3-mbed-firmware-can): 1 Mbit/s, 11-bit identifiers made of operation + node, little-endian payloads.
What does not fit is counted and dropped, never raised: a bus is shared, and a foreign frame is no error. The controller
has checked the CRC of 15 bits already, so what arrives damaged passed it, or was damaged between controller and host.
"""

import enum
import struct

from palpate.drivers.can import CanFrame, FrameKind
from palpate.drivers.errors import RefusedError
from palpate.drivers.jr3.messages import Ack, Bootup, Forces, Moments, Op, Reading, Request, TransportCounts


class Jr3Code(enum.IntEnum):
    """What stands in front of the node number of a JR3 board in what it sends."""

    ACK = 0x100
    FORCES = 0x600
    MOMENTS = 0x680
    BOOTUP = 0x700


_NODE_MASK, _OP_MASK = 0x07F, 0x780
_READING, _SCALES = struct.Struct("<3hH"), struct.Struct("<3H")
_READY, _NOT_INITIALISED = 0, 1


def encode_can(request: Request, node: int) -> CanFrame:
    """Make the frame of a request."""
    if not 1 <= node <= _NODE_MASK:
        raise RefusedError("JR3 on CAN", f"cannot send {request.op.name} to node {node}", "nodes are 1 to 127")
    return CanFrame(request.op + node, pack_arguments(request))


def pack_arguments(request: Request) -> bytes:
    """Payload of a request.

    FACT (jr3-mbed-firmware-can main.cpp): the cut-off is 16 bits, and the period of START 32 bits after it.
    """
    try:
        if request.op is Op.START:
            return struct.pack("<HI", request.cutoff_cHz, request.period_us)
    except struct.error as error:
        values = f"cut-off {request.cutoff_cHz} (16 bits) and period {request.period_us} (32 bits)"
        raise RefusedError("JR3", f"{values} do not fit their fields", "check the settings") from error
    return b""


class CanDecoder:
    """Decodes the frames of one node."""

    def __init__(self, node: int) -> None:
        self.counts = TransportCounts()
        self._node = node

    def decode(self, frame: CanFrame) -> Ack | Forces | Moments | Bootup | None:
        """What a frame says; None when it is not ours or makes no sense (see :attr:`counts`)."""
        if frame.kind is not FrameKind.DATA or not 0 <= frame.can_id <= _OP_MASK | _NODE_MASK:
            self.counts.garbage += 1
            return None
        if frame.can_id & _NODE_MASK != self._node:
            self.counts.foreign += 1
            return None
        op, data = frame.can_id & _OP_MASK, frame.data
        if op in (Jr3Code.FORCES, Jr3Code.MOMENTS) and len(data) == _READING.size:
            x, y, z, counter = _READING.unpack(data)
            self.counts.good += 1
            return Forces((x, y, z), counter) if op == Jr3Code.FORCES else Moments((x, y, z), counter)
        if op == Jr3Code.ACK and len(data) in (1, 1 + _SCALES.size):
            return self._ack(data)
        if op == Jr3Code.BOOTUP and not data:
            self.counts.good += 1
            return Bootup()
        if op in (Jr3Code.ACK, Jr3Code.FORCES, Jr3Code.MOMENTS, Jr3Code.BOOTUP):
            self.counts.garbage += 1
        else:
            self.counts.foreign += 1
        return None

    def _ack(self, data: bytes) -> Ack | None:
        if data[0] not in (_READY, _NOT_INITIALISED):
            self.counts.garbage += 1
            return None
        self.counts.good += 1
        return Ack(data[0] == _READY, _SCALES.unpack_from(data, 1) if len(data) > 1 else ())


class Reassembly:
    """Joins halves in either order and keeps at most one of each kind waiting.

    Attributes:
        orphans: Halves whose other half never came.
    """

    def __init__(self) -> None:
        self.orphans = 0
        self.duplicates = 0
        self._forces: Forces | None = None
        self._moments: Moments | None = None

    def clear(self) -> None:
        """Forget the halves that wait; after a restart equal counters mean nothing."""
        self.orphans += (self._forces is not None) + (self._moments is not None)
        self._forces = self._moments = None

    def add(self, half: Forces | Moments) -> Reading | None:
        """Take one half; give back the reading that it completes, or None."""
        if isinstance(half, Forces):
            self._displaced(self._forces, half.counter)
            self._forces = half
        else:
            self._displaced(self._moments, half.counter)
            self._moments = half
        forces, moments = self._forces, self._moments
        if forces is None or moments is None or forces.counter != moments.counter:
            return None
        self._forces = self._moments = None
        return Reading(forces.counts, moments.counts, half.counter)

    def _displaced(self, waiting: Forces | Moments | None, counter: int) -> None:
        if waiting is None:
            return
        if waiting.counter == counter:
            self.duplicates += 1
        else:
            self.orphans += 1
