"""Serial ports of pyserial, opened and closed in one place, so that nothing waits for ever on one."""

from contextlib import suppress
from select import select
from typing import Any, Final, Protocol

import serial

from palpate.drivers.errors import WiringError

WRITE_TIMEOUT_S: Final = 0.1
"""Longest wait for a port that does not take what is written; without one pyserial waits for ever (FACT)."""


class ByteStream(Protocol):
    """A serial port as of pyserial, opened by the caller, so that sockets and pseudo-terminals do as well.

    Attributes:
        baudrate: Line rate, bit/s.
        timeout: Longest wait of ``read``, s. Drivers set it seldom, because that reconfigures the port on some systems
            (FACT, pyserial issue 394).
        write_timeout: Longest wait of ``write``, s.
    """

    baudrate: int
    timeout: float | None
    write_timeout: float | None

    @property
    def in_waiting(self) -> int:
        """Bytes that have arrived and were not read."""

    def read(self, size: int = 1, /) -> bytes:
        """Up to ``size`` bytes, fewer after ``timeout``; raises ``OSError`` when the port is gone."""

    def write(self, data: bytes, /) -> int | None:
        """Sends the bytes; raises ``OSError`` when the port is gone."""

    def reset_input_buffer(self) -> None:
        """Throws away what has arrived."""


def open_serial(name: str, baud: int, device: str) -> Any:
    """Open a port, 8N1, for this program alone.

    Raises:
        WiringError: It cannot be opened.
    """
    try:
        return serial.serial_for_url(name, baud, write_timeout=WRITE_TIMEOUT_S, exclusive=True)
    except (serial.SerialException, OSError, ValueError) as error:
        remedy = (
            "check the name, that it is plugged in, that you may open it (group dialout), and that no other program has"
        )
        raise WiringError(device, f"{name} cannot be opened ({error})", remedy) from error


def write_unless_stuck(port: ByteStream, data: bytes) -> None:
    """Write to a port whose reader asks again for what did not come.

    pyserial calls a write late by its clock alone, also when every byte was taken and this program was held up for
    longer than the timeout before it looked (FACT, serialposix.py of 3.5). A port that takes bytes now is not stuck;
    whether it took these shows in the reply.

    Raises:
        OSError: The port takes no bytes, or is gone.
    """
    try:
        port.write(data)
    except serial.SerialTimeoutException:
        if not isinstance(port, serial.Serial) or not select([], [port.fileno()], [], 0.0)[1]:
            raise


def close_serial(port: Any) -> None:
    """Close a port now. What it could not send is thrown away: Linux would wait 30 s for that (FACT, closing_wait)."""
    # A port that is gone cannot be asked; whatever it raises, it is closed next.
    with suppress(Exception):
        if port.out_waiting:
            port.reset_output_buffer()
    with suppress(OSError):
        port.close()
