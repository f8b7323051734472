"""The slcan line protocol of a USB-CAN adapter, seen from the adapter."""

from __future__ import annotations

from enum import Enum, auto

from palpate.simulation.emulators.lines.can_frame import CanFrame

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


class Mode(Enum):
    """State of the adapter's channel."""

    CLOSED = auto()
    OPEN = auto()
    LISTEN_ONLY = auto()


def frame_line(frame: CanFrame) -> bytes:
    """Line by which the adapter tells the host of a received frame."""
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
        self.mode = Mode.CLOSED
        self.bit_rate_Hz: int | None = None
        """Bit rate the host has set, bit/s; None before, or after a setting of the registers."""
        self.overrun = False
        """Whether frames were lost because the host did not read; told and cleared by the F command."""
        self._line = bytearray()

    def take(self, data: bytes) -> tuple[bytes, list[CanFrame]]:
        """Take bytes from the host.

        Args:
            data: What came in, which may begin and end within a line.

        Returns:
            Answer for the host, and frames to send.
        """
        answer = b""
        frames: list[CanFrame] = []
        for byte in data:
            if byte != DONE[0]:
                self._line.append(byte)
                continue
            line = bytes(self._line)
            self._line.clear()
            if len(line) > LONGEST_LINE_BYTES:
                answer += ERROR
            elif line:
                answer += self._obey(line[:1], line[1:], frames)
        del self._line[LONGEST_LINE_BYTES + 1 :]
        return answer, frames

    def _obey(self, command: bytes, rest: bytes, frames: list[CanFrame]) -> bytes:
        if command in _IDENTIFIER_DIGITS:
            return self._send(command, rest, frames)
        closed = self.mode is Mode.CLOSED
        match command:
            case b"S" if closed and rest in BIT_RATES_Hz:
                self.bit_rate_Hz = BIT_RATES_Hz[rest]
            case b"s" if closed and _hexadecimal(rest, 4) is not None:
                self.bit_rate_Hz = None
            case b"O" if closed and not rest:
                self.mode = Mode.OPEN
            case b"L" if closed and not rest:
                self.mode = Mode.LISTEN_ONLY
            case b"C" if not closed and not rest:
                self.mode = Mode.CLOSED
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

    def _send(self, command: bytes, rest: bytes, frames: list[CanFrame]) -> bytes:
        digits = _IDENTIFIER_DIGITS[command]
        identifier = _hexadecimal(rest[:digits], digits)
        remote = command in b"rR"
        data = _payload(rest[digits:], remote)
        if self.mode is not Mode.OPEN or identifier is None or identifier > _LARGEST_IDENTIFIER[digits] or data is None:
            return ERROR
        if command == b"t":
            frames.append(CanFrame(identifier, data))
        return (b"z" if digits == 3 else b"Z") + DONE
