"""Functions that open, write to and close pyserial ports without blocking indefinitely."""

from contextlib import suppress
from select import select
from typing import Any, Final, Protocol

import serial

from palpate.drivers.errors import WiringError

WRITE_TIMEOUT_S: Final = 0.1
"""Maximum wait for a port that accepts no bytes; without a limit, pyserial waits forever (FACT)."""


class ByteStream(Protocol):
    """A serial port with pyserial's interface, opened by the caller; sockets and pseudo-terminals may also provide it.

    Attributes:
        baudrate: Line rate in bit/s.
        timeout: Maximum wait in ``read``, s. Drivers rarely set it, because that reconfigures the port on some systems
            (FACT, pyserial issue 394).
        write_timeout: Maximum wait in ``write``, s.
    """

    baudrate: int
    timeout: float | None
    write_timeout: float | None

    @property
    def in_waiting(self) -> int:
        """Number of received bytes that have not yet been read."""

    def read(self, size: int = 1, /) -> bytes:
        """Return ``size`` bytes, or fewer after ``timeout``; raises ``OSError`` if the port is gone."""

    def write(self, data: bytes, /) -> int | None:
        """Send the bytes; raises ``OSError`` if the port is gone."""

    def reset_input_buffer(self) -> None:
        """Discard received bytes."""


def open_serial(name: str, baud: int, device: str) -> Any:
    """Open a port, 8N1, for exclusive use.

    Raises:
        WiringError: The port cannot be opened.
    """
    try:
        return serial.serial_for_url(name, baud, write_timeout=WRITE_TIMEOUT_S, exclusive=True)
    except (serial.SerialException, OSError, ValueError) as error:
        remedy = (
            "check the name, that it is plugged in, that you may open it (group dialout), and that no other program has"
        )
        raise WiringError(device, f"{name} cannot be opened ({error})", remedy) from error


def write_unless_stuck(port: ByteStream, data: bytes) -> None:
    """Write to a port, ignoring a time-out if the port accepts bytes; a missing reply reveals lost bytes.

    pyserial reports a time-out based on its clock alone, even if every byte was accepted and this program was delayed
    for longer than the timeout (FACT, serialposix.py of 3.5). A port that accepts bytes now is not stuck.

    Raises:
        OSError: The port accepts no bytes, or is gone.
    """
    try:
        port.write(data)
    except serial.SerialTimeoutException:
        if not isinstance(port, serial.Serial) or not select([], [port.fileno()], [], 0.0)[1]:
            raise


def close_serial(port: Any) -> None:
    """Close a port immediately. Unsent bytes are discarded; Linux would wait 30 s for them (FACT, closing_wait)."""
    # A port that is gone may raise any exception here; it is closed next.
    with suppress(Exception):
        if port.out_waiting:
            port.reset_output_buffer()
    with suppress(OSError):
        port.close()
