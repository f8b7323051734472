"""An emulated USB-CAN adapter for the slcan protocol, with emulated nodes on its bus. A ``PtyServer`` serves it."""

import re
from typing import Final

from palpate.simulation.emulators.lines.can_bus import BusFrame, EmulatedCanBus

_DONE, _ERROR = b"\r", b"\a"
_BIT_RATES_Hz: Final = dict(
    zip(b"012345678", (10_000, 20_000, 50_000, 100_000, 125_000, 250_000, 500_000, 800_000, 1_000_000), strict=True)
)
"""Bit rates for the S command. FACT: LAWICEL CANUSB manual. python-can's slcan uses 7 for 750 kbit/s."""
_LONGEST_LINE_BYTES: Final = 31
"""Maximum line length for a classic frame: T, 8 digits, length, 16 digits, and space for a timestamp. CALC."""
_FRAME: Final = re.compile(rb"t([0-7][0-9a-fA-F]{2})([0-8])((?:[0-9a-fA-F]{2})*)")


class SlcanAdapter:
    """A USB-CAN adapter as a ``SerialEmulator``.

    It supports the commands that hosts need: S sets the bit rate, O opens, C closes, and t sends a frame. Extended and
    remote frames are rejected, because no emulated node reacts to them. An empty line is ignored (assumed; python-can
    sends one while it sets the bit rate). An adapter whose bit rate differs from the bus's exchanges no frames.
    """

    baud: Final = 115_200

    def __init__(self, bus: EmulatedCanBus) -> None:
        self.bus, self.is_open = bus, False
        self.bit_rate_Hz: int | None = None
        self._line = b""

    def feed(self, data: bytes, now_ns: int) -> bytes:
        """Receive bytes from the host and return the reply and the frames that follow immediately."""
        *lines, rest = (self._line + data).split(_DONE)
        self._line = rest[: _LONGEST_LINE_BYTES + 1]
        return b"".join([self._execute(line) for line in lines if line]) + self.advance(now_ns)

    def advance(self, now_ns: int) -> bytes:
        """Advance the time of the bus and return the frames that the host receives."""
        frames = self.bus.advance(now_ns)
        lines = (b"t%03X%d%s" % (f.arbitration_id, len(f.data), f.data.hex().upper().encode()) + _DONE for f in frames)
        return b"".join(lines) if self._on_bus() else b""

    def _execute(self, line: bytes) -> bytes:
        if self.is_open and (found := _FRAME.fullmatch(line)) and len(found[3]) == 2 * int(found[2]):
            if self._on_bus():
                self.bus.send(BusFrame(int(found[1], 16), bytes.fromhex(found[3].decode())))
            return b"z" + _DONE
        if line[:1] == b"S" and len(line) == 2 and not self.is_open and line[1] in _BIT_RATES_Hz:
            self.bit_rate_Hz = _BIT_RATES_Hz[line[1]]
        elif line == (b"C" if self.is_open else b"O"):
            self.is_open = not self.is_open
        else:
            return _ERROR
        return _DONE

    def _on_bus(self) -> bool:
        return self.is_open and self.bit_rate_Hz == self.bus.bit_rate_Hz
