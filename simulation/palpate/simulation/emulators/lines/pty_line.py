"""A pseudo-terminal that stands for a serial port."""

from __future__ import annotations

import fcntl
import os
import select
import struct
import termios
import tty
from typing import Final

_TCGETS2: Final = (
    0x802C542A  # FACT, Linux <asm-generic/termbits.h>: struct termios2 has 44 bytes, the output speed last
)
_TERMIOS2: Final = struct.Struct("=40xI")


class PtyLine:
    """A raw pseudo-terminal; the device has the master, the host opens the slave's path.

    The slave is kept open here too: a master whose slave nobody has open cannot be read, and a host may come and go.

    Args:
        baud: Rate to preset, so that a host which never sets one is understood.

    Attributes:
        master: File descriptor, non-blocking.
        path: Path of the slave.
    """

    def __init__(self, baud: int) -> None:
        self.master, self._slave = os.openpty()
        tty.setraw(self._slave)
        attributes = termios.tcgetattr(self._slave)
        attributes[4:6] = [getattr(termios, f"B{baud}", termios.B38400)] * 2
        termios.tcsetattr(self._slave, termios.TCSANOW, attributes)
        os.set_blocking(self.master, False)
        self.path = os.ttyname(self._slave)

    def host_baud(self) -> int:
        """Rate that the host has set; also one without a name in ``termios``, as 250000."""
        (baud,) = _TERMIOS2.unpack(fcntl.ioctl(self._slave, _TCGETS2, bytes(_TERMIOS2.size)))
        return int(baud)

    def read(self, size: int) -> bytes:
        """What the host has written; nothing if nothing is there."""
        try:
            return os.read(self.master, size)
        except BlockingIOError:
            return b""

    def write(self, data: bytes) -> None:
        """Hand bytes to the host; what its full buffer cannot take is lost, as in a UART without handshake."""
        if select.select([], [self.master], [], 0.0)[1]:
            os.write(self.master, data)

    def close(self) -> None:
        """Hang up."""
        os.close(self.master)
        os.close(self._slave)
