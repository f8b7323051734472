r"""Serial bytes to messages and back: an incremental parser that no input can upset, and an encoder.

FACT (README and main.cpp of jr3-mbed-firmware-uart): 115200 baud, 8N1; a frame is ``<``, two ASCII digits, a raw
little-endian payload and ``>``; there is no length, no escape and no checksum. Payload bytes may be ``<`` or ``>``, so
reading up to the next ``>`` loses 5.3 % of all readings (CALC, payload bytes uniformly random). This parser goes by the
fixed length of each operation instead.

How far to trust a frame: there is no checksum and 14 of the 18 bytes of a reading are payload, so 77.8 % of all
readings with one damaged bit parse as good (CALC; 75 % with three damaged bytes in a row, measured). The check of the
frame counter in :mod:`palpate.drivers.jr3.sampling` leaves 71 % to 72 % (measured, 10 ms). A lost byte is always
noticed. Random bytes look like a frame once in 2**31 positions (CALC), about every two days of pure noise. CAN frames
bear a CRC of 15 bits.
"""

import struct

from palpate.drivers.errors import RefusedError
from palpate.drivers.jr3.codec_can import pack_arguments
from palpate.drivers.jr3.messages import Ack, Bootup, Message, Op, Reading, Request, TransportCounts

MAX_FRAME = 18
"""Bytes of the longest frame from the board, a reading. FACT."""

_START, _END = 0x3C, 0x3E
_COMMANDS = {
    Op.START: b"02",
    Op.STOP: b"03",
    Op.GET_STATE: b"06",
    Op.GET_SCALES: b"07",
}
_READING, _SCALES = struct.Struct("<6hH"), struct.Struct("<6H")
_PREFIX = 3
_SHORT_ACK, _LONG_ACK, _BOOTUP = 5, 17, 4


def encode_uart(request: Request) -> bytes:
    """Make the frame of a request, to be written in one call.

    Raises:
        RefusedError: The command does not exist on this wire, an argument does not fit its field, or its bytes would
            look like a delimiter to the board; :func:`nudged` finds a neighbour that does not.
    """
    op, payload = _COMMANDS.get(request.op), pack_arguments(request)
    if op is None:
        raise RefusedError("JR3 on a serial line", f"has no command {request.op.value!r}", "use the serial commands")
    if _START in payload or _END in payload:
        raise RefusedError("JR3 on a serial line", f"cannot be told {request}", "nudge the value")
    return b"<" + op + payload + b">"


def nudged(value: int, size: int) -> int:
    """The nearest value of which no byte is 0x3C or 0x3E; the smaller of two equally near ones.

    FACT (jr3-mbed-firmware-uart main.cpp): the board skips 0x3C and stops at 0x3E wherever they are. CALC: for a value
    below 2**20 the nudge is 1 when only the lowest byte is to blame, and otherwise at most 128 (0x3C7F becomes 0x3BFF):
    up to 1.28 Hz of 155 Hz for a cut-off in 0.01 Hz and 0.13 ms of 15.5 ms for a period in microseconds, or 0.83 %.
    """
    for distance in range(1 << 8 * size):
        for candidate in (value - distance, value + distance):
            if 0 <= candidate < 1 << 8 * size:
                field = candidate.to_bytes(size, "little")
                if _START not in field and _END not in field:
                    return candidate
    raise RefusedError("JR3 on a serial line", f"no value near {value} fits {size} bytes", "check the settings")


class UartParser:
    """Takes bytes in chunks of any size and gives back what they say, the same for every chunking.

    Never holds more than one frame. After garbage the first good frame is found, unless the garbage happens to end like
    the beginning of a frame whose end mark falls onto a payload byte; then at most that one frame is lost.

    Attributes:
        expect_scales: Whether the request in flight is answered by full scales. The board's acknowledgements are 5 or
            17 bytes long and only the host can know which: a force scale of 62 N has 0x3E in its first byte, where a
            short acknowledgement ends. To be set before the request is sent.
    """

    def __init__(self) -> None:
        self.counts = TransportCounts()
        self.expect_scales = False
        self._pending = b""

    @property
    def pending(self) -> int:
        """Bytes that wait for the rest of their frame; always less than :data:`MAX_FRAME`."""
        return len(self._pending)

    def clear(self) -> None:
        """Forget a frame that has begun."""
        self._pending = b""

    def feed(self, chunk: bytes) -> list[Message]:
        """Take some bytes; give back the messages that they complete."""
        data = self._pending + chunk
        messages: list[Message] = []
        at = 0
        while True:
            start = data.find(b"<", at)
            self.counts.garbage += (len(data) if start < 0 else start) - at
            if start < 0:
                at = len(data)
                break
            at = start
            size = self._frame_size(data, at)
            if size is None:
                break
            message = self._decode(data, at, size) if size else None
            if message is None:
                self.counts.garbage += 1
                at += 1
            else:
                self.counts.good += 1
                messages.append(message)
                at += size
        self._pending = data[at:]
        return messages

    def _frame_size(self, data: bytes, at: int) -> int | None:
        """Bytes of the frame that may begin here; 0 when none does, None when more bytes must tell."""
        have, op = len(data) - at, data[at + 1 : at + _PREFIX]
        if len(op) < 2:
            return None if op in (b"", b"0", b"1") else 0
        if op == b"01":
            return self._ack_size(data, at)
        size = {b"09": MAX_FRAME, b"10": _BOOTUP}.get(op, 0)
        if have < size:
            return None
        return size if size and data[at + size - 1] == _END else 0

    def _ack_size(self, data: bytes, at: int) -> int | None:
        have = len(data) - at
        if have > _PREFIX and data[at + _PREFIX] > 1:
            return 0
        if have < _SHORT_ACK:
            return None
        ends = data[at + _SHORT_ACK - 1] == _END
        if ends and not self.expect_scales:
            return _SHORT_ACK
        if ends and have == _SHORT_ACK:
            return None
        # No force scale reaches 0x3C00 N: where the next frame begins, the acknowledgement was a short one.
        if ends and data[at + _SHORT_ACK] == _START:
            return _SHORT_ACK
        if have < _LONG_ACK:
            return None
        if data[at + _LONG_ACK - 1] == _END:
            return _LONG_ACK
        return _SHORT_ACK if ends else 0

    @staticmethod
    def _decode(data: bytes, at: int, size: int) -> Message:
        if size == MAX_FRAME:
            fx, fy, fz, mx, my, mz, counter = _READING.unpack_from(data, at + _PREFIX)
            return Reading((fx, fy, fz), (mx, my, mz), counter)
        if size == _BOOTUP:
            return Bootup()
        scales = _SCALES.unpack_from(data, at + _PREFIX + 1) if size == _LONG_ACK else ()
        return Ack(data[at + _PREFIX] == 0, scales)
