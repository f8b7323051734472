"""Server for an emulated serial device on a pseudo-terminal, with real line timing."""

from __future__ import annotations

import fcntl
import os
import select
import struct
import termios
import threading
import time
import tty
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Final, Generic

from palpate.simulation.emulators.lines.serial_line import Emulator, SerialLine

_TCGETS2: Final = (
    0x802C542A  # FACT, Linux <asm-generic/termbits.h>: struct termios2 has 44 bytes, the output speed last
)
_TERMIOS2: Final = struct.Struct("=40xI")


class PtyLine:
    """A raw pseudo-terminal. The device uses the master, and the host opens the slave's path.

    The server also keeps the slave open, because hosts may connect and disconnect, and a master without an open slave
    cannot be read.
    """

    def __init__(self, baud: int = 38400) -> None:
        self.master, self._slave = os.openpty()
        tty.setraw(self._slave)
        attributes = termios.tcgetattr(self._slave)
        attributes[4:6] = [getattr(termios, f"B{baud}", termios.B38400)] * 2
        termios.tcsetattr(self._slave, termios.TCSANOW, attributes)
        os.set_blocking(self.master, False)
        self.path = os.ttyname(self._slave)

    def host_baud(self) -> int:
        """Return the rate set by the host, including rates without a name in ``termios`` such as 250000."""
        (baud,) = _TERMIOS2.unpack(fcntl.ioctl(self._slave, _TCGETS2, bytes(_TERMIOS2.size)))
        return int(baud)

    def read(self, size: int) -> bytes:
        """Return the bytes that the host has written, if any."""
        try:
            return os.read(self.master, size)
        except BlockingIOError:
            return b""

    def write(self, data: bytes | bytearray) -> int:
        """Pass bytes to the host and return the number that its buffer accepted."""
        try:
            return os.write(self.master, data)
        except BlockingIOError:
            return 0

    def close(self) -> None:
        """Hang up the line."""
        os.close(self.master)
        os.close(self._slave)


_NS: Final = 1_000_000_000
_READ_SIZE: Final = 4096
_BACKLOG_BYTES: Final = 16_384
"""Buffer size for when the host is not reading. Further bytes are lost, as in a UART without handshake (assumed)."""
_WAKES_LATE_NS: Final = 60_000  # usual delay of a wake-up on an ordinary kernel


class PtyServer(Generic[Emulator]):
    """Context manager whose thread connects an emulator to a pseudo-terminal, at the line rate if ``paced``."""

    def __init__(
        self, emulator: Emulator, clock_ns: Callable[[], int] = time.monotonic_ns, *, paced: bool = True
    ) -> None:
        self._serial, self._clock_ns = SerialLine(emulator, paced=paced), clock_ns
        self._backlog = bytearray()
        self._lock = threading.Lock()
        self._line: PtyLine | None = None
        self._thread = threading.Thread(target=self._serve, name="serial-emulator", daemon=True)
        self._stopping = False

    @property
    def path(self) -> str:
        """Path that the host opens. Raises OSError while unplugged."""
        if self._line is None:
            raise OSError("the emulated port is not plugged in")
        return self._line.path

    def __enter__(self) -> PtyServer[Emulator]:
        self._line = PtyLine(self._serial.emulator.baud)
        self._serial.connect(self._line.host_baud, self._clock_ns())
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._stopping = True
        self._thread.join()
        self.unplug()

    @contextmanager
    def exclusive(self) -> Iterator[Emulator]:
        """Yield the emulator; the server's thread does not access it within the context."""
        with self._lock:
            yield self._serial.emulator

    def unplug(self) -> None:
        """Unplug the adapter if it is plugged in. The host sees a hang-up, and the device keeps its power."""
        with self._lock:
            line, self._line = self._line, None
            self._serial.disconnect()
            if line is not None:
                line.close()

    def _serve(self) -> None:
        while not self._stopping:
            with self._lock:
                for data in self._serial.step(self._clock_ns()):
                    self._backlog += data if len(self._backlog) < _BACKLOG_BYTES else b""
                self._write()
                fds = [] if self._line is None else [self._line.master]
                timeout_s = max(0, self._serial.next_event_ns() - self._clock_ns() - _WAKES_LATE_NS) / _NS
            try:
                # The next event is at most a millisecond away, so a terminal that is closed meanwhile ends by then.
                ready, _, _ = select.select(fds, [], [], timeout_s)
            except OSError:
                continue  # the terminal was closed between the lock and the call
            with self._lock:
                self._write()
                if self._line is not None and self._line.master in ready:
                    self._serial.receive(self._line.read(_READ_SIZE), self._clock_ns())

    def _write(self) -> None:
        # A full terminal accepts some bytes or none; the rest is sent later.
        if self._backlog and self._line is not None:
            del self._backlog[: self._line.write(self._backlog)]
