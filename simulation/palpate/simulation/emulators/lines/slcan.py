"""A USB-CAN adapter that speaks slcan on a pseudo-terminal, with emulated nodes on its bus."""

import contextlib
import os
import select
import time
from collections.abc import Callable
from enum import Enum, auto

from palpate.simulation.emulators.lines.can_bus import BusFrame, EmulatedCanBus
from palpate.simulation.emulators.lines.can_bus_server import CanBusServer, DEFAULT_TICK_s
from palpate.simulation.emulators.lines.pty_server import PtyLine

DONE, ERROR = b"\r", b"\a"

BIT_RATES_Hz = {
    b"0": 10_000,
    b"1": 20_000,
    b"2": 50_000,
    b"3": 100_000,
    b"4": 125_000,
    b"5": 250_000,
    b"6": 500_000,
    b"7": 800_000,
    b"8": 1_000_000,
}
"""Bit rates of the S command. FACT: LAWICEL CANUSB manual; python-can's slcan takes 7 for 750 kbit/s."""

VERSION = b"V1013"
SERIAL_NUMBER = b"NPALP"
LONGEST_LINE_BYTES = 31
"""Longest classic frame: T, 8 digits, length, 16 digits, and some room for a time stamp. CALC."""

_IDENTIFIER_DIGITS = {b"t": 3, b"r": 3, b"T": 8, b"R": 8}
_LARGEST_IDENTIFIER = {3: 0x7FF, 8: 0x1FFFFFFF}


class ChannelMode(Enum):
    """State of the adapter's channel."""

    CLOSED = auto()
    OPEN = auto()
    LISTEN_ONLY = auto()


def frame_line(frame: BusFrame) -> bytes:
    """Line by which the adapter passes a received frame to the host."""
    return b"t%03X%d" % (frame.arbitration_id, len(frame.data)) + frame.data.hex().upper().encode() + DONE


def _hexadecimal(digits: bytes, count: int) -> int | None:
    if len(digits) != count or not all(digit in b"0123456789abcdefABCDEF" for digit in digits):
        return None
    return int(digits, 16)


def _payload(line: bytes, remote: bool) -> bytes | None:
    """Payload of what follows the identifier: one digit of length and the bytes, or None for a bad line."""
    length = _hexadecimal(line[:1], 1)
    if length is None or length > 8:
        return None
    digits = b"" if remote else line[1:]
    if remote and len(line) > 1:
        return None
    if not remote and (len(digits) != 2 * length or (digits and _hexadecimal(digits, 2 * length) is None)):
        return None
    return bytes.fromhex(digits.decode("ascii"))


class Adapter:
    """Takes the host's bytes, answers them, and gives the frames that go on the bus.

    Extended and remote frames are accepted and go nowhere: no emulated node reacts to one. An empty line is passed
    over in silence (assumed; python-can sends one while it sets the bit rate).
    """

    def __init__(self) -> None:
        self.mode = ChannelMode.CLOSED
        self.bit_rate_Hz: int | None = None
        """Bit rate the host has set, bit/s; None before, or after a setting of the registers."""
        self.overrun = False
        """Whether frames were lost because the host did not read; reported and cleared by the F command."""
        self._line = bytearray()

    def take(self, data: bytes) -> tuple[bytes, list[BusFrame]]:
        """Take bytes from the host; gives the answer for it, and frames to send."""
        answer = b""
        frames: list[BusFrame] = []
        for byte in data:
            if byte != DONE[0]:
                self._line.append(byte)
                continue
            line = bytes(self._line)
            self._line.clear()
            if len(line) > LONGEST_LINE_BYTES:
                answer += ERROR
            elif line:
                answer += self._execute(line[:1], line[1:], frames)
        del self._line[LONGEST_LINE_BYTES + 1 :]
        return answer, frames

    def _execute(self, command: bytes, rest: bytes, frames: list[BusFrame]) -> bytes:
        if command in _IDENTIFIER_DIGITS:
            return self._send(command, rest, frames)
        closed = self.mode is ChannelMode.CLOSED
        match command:
            case b"S" if closed and rest in BIT_RATES_Hz:
                self.bit_rate_Hz = BIT_RATES_Hz[rest]
            case b"s" if closed and _hexadecimal(rest, 4) is not None:
                self.bit_rate_Hz = None
            case b"O" if closed and not rest:
                self.mode = ChannelMode.OPEN
            case b"L" if closed and not rest:
                self.mode = ChannelMode.LISTEN_ONLY
            case b"C" if not closed and not rest:
                self.mode = ChannelMode.CLOSED
            case b"V" if not rest:
                return VERSION + DONE
            case b"N" if not rest:
                return SERIAL_NUMBER + DONE
            case b"F" if not closed and not rest:
                flags, self.overrun = int(self.overrun), False
                return b"F%02X" % flags + DONE
            case _:
                return ERROR
        return DONE

    def _send(self, command: bytes, rest: bytes, frames: list[BusFrame]) -> bytes:
        digits = _IDENTIFIER_DIGITS[command]
        identifier = _hexadecimal(rest[:digits], digits)
        remote = command in b"rR"
        data = _payload(rest[digits:], remote)
        if (
            self.mode is not ChannelMode.OPEN
            or identifier is None
            or identifier > _LARGEST_IDENTIFIER[digits]
            or data is None
        ):
            return ERROR
        if command == b"t":
            frames.append(BusFrame(identifier, data))
        return (b"z" if digits == 3 else b"Z") + DONE


BACKLOG_BYTES = 16_384
"""What the adapter keeps for a host that does not read, bytes; later frames are lost. assumed."""

_READ_BYTES = 4096


class SlcanServer(CanBusServer):
    """Serves an slcan adapter at the path `channel`, for drivers in this or another process.

    An adapter that is set to another bit rate than the bus exchanges nothing with it.
    """

    def __init__(
        self,
        wire: EmulatedCanBus,
        *,
        tick_s: float = DEFAULT_TICK_s,
        clock_ns: Callable[[], int] = time.monotonic_ns,
    ) -> None:
        super().__init__(wire, tick_s=tick_s, clock_ns=clock_ns)
        self.adapter = Adapter()
        self.frames_lost = 0
        """Frames the host has missed because it did not read."""
        self._backlog = bytearray()
        self._line = PtyLine()
        self._master = self._line.master
        self.channel = self._line.path
        """Path of the terminal to give to python-can."""
        self._plugged = True

    def unplug(self) -> None:
        """Pull the cable: the host's terminal hangs up. The server ends and cannot be plugged in again."""
        self.do(lambda _: self._pull())

    def inject(self, line: bytes) -> None:
        """Have any bytes sent to the host as they are."""
        self.do(lambda _: self._backlog.extend(line))

    def _pull(self) -> None:
        if self._plugged:
            self._plugged = False
            self._line.close()

    def _on_bus(self) -> bool:
        return self.adapter.mode is not ChannelMode.CLOSED and self.adapter.bit_rate_Hz == self.wire.bit_rate_Hz

    def _receive(self, timeout_s: float) -> list[BusFrame]:
        if not self._plugged:
            self._closing.wait(timeout_s)
            return []
        wants_out = [self._master] if self._backlog else []
        readable, writable, _ = select.select([self._master], wants_out, [], timeout_s)
        if writable:
            self._write()
        if not readable:
            return []
        answer, frames = self.adapter.take(os.read(self._master, _READ_BYTES))
        self._backlog += answer
        return frames if self._on_bus() else []

    def _transmit(self, frames: list[BusFrame]) -> None:
        if not self._plugged:
            return
        for frame in frames if self._on_bus() else []:
            if len(self._backlog) > BACKLOG_BYTES:
                self.adapter.overrun = True
                self.frames_lost += 1
            else:
                self._backlog += frame_line(frame)
        self._write()

    def _write(self) -> None:
        # A full terminal takes nothing or a part; the rest waits for its turn.
        with contextlib.suppress(BlockingIOError):
            while self._backlog:
                del self._backlog[: os.write(self._master, self._backlog)]

    def _release(self) -> None:
        self._pull()
