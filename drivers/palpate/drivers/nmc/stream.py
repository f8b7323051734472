"""The byte stream that the bus talks over: what it needs of a serial port, and no more."""

from __future__ import annotations

from typing import Protocol


class ByteStream(Protocol):
    """A serial port as of pyserial, opened by the caller, so that sockets and pseudo-terminals do as well.

    Attributes:
        baudrate: Line rate, bit/s; the bus sets it.
        timeout: Longest wait of ``read``, s; the bus sets it, and only when the rate changes, because that
            reconfigures the port on some systems.
    """

    baudrate: int
    timeout: float | None

    @property
    def in_waiting(self) -> int:
        """Bytes that have arrived and were not read."""

    def read(self, size: int = 1, /) -> bytes:
        """Up to ``size`` bytes, fewer after ``timeout``; raises ``OSError`` when the port is gone."""

    def write(self, data: bytes, /) -> int | None:
        """Sends the bytes; raises ``OSError`` when the port is gone."""

    def reset_input_buffer(self) -> None:
        """Throws away what has arrived."""
