"""Serves an emulated serial device on a pseudo-terminal, with the timing of a real line."""

from __future__ import annotations

import os
import select
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Generic, Protocol, TypeVar

import numpy as np

from palpate.simulation.emulators.lines.faults import FaultInjector
from palpate.simulation.emulators.lines.pty_line import PtyLine, same_rate

_NS: Final = 1_000_000_000
_BITS_PER_BYTE: Final = 10  # 8N1
_READ_SIZE: Final = 4096
_RX_GRAIN_NS: Final = 500_000
_WAKES_LATE_NS: Final = 60_000  # an ordinary kernel ends a sleep about that much late
_FTDI_PACKET: Final = 62  # payload of a full-speed USB packet of 64 bytes (FACT, FTDI chips put two status bytes first)


class SerialEmulator(Protocol):
    """A device at the byte level that a server can put on a line. It reads no clock: time only comes as `now_ns`.

    `now_ns` never goes back by more than the grain of the server's wake-ups; an emulator ignores time that does.
    """

    @property
    def baud(self) -> int:
        """Line rate at which the device sends and receives now, 8N1."""

    def feed(self, data: bytes, now_ns: int) -> bytes:
        """Take bytes from the host, the last of which has arrived at `now_ns`; returns what the device answers."""

    def advance(self, now_ns: int) -> bytes:
        """Let time go on; returns what the device sends by itself."""


Emulator = TypeVar("Emulator", bound=SerialEmulator)


@dataclass(frozen=True, slots=True)
class LineTiming:
    """How fast a line is.

    Attributes:
        paced: Whether bytes take their time (10 bits each at the device's rate); else everything is at once.
        turnaround_s: From the end of a command to the start of its answer (assumed).
        usb_latency_s: Latency timer of a USB adapter: what has arrived is handed to the host when the timer ends or
            62 bytes are together. 0 is a plain port, 0.016 an FTDI chip's default, 0.001 its lowest setting.
        poll_s: Longest time between two calls of `advance`.
    """

    paced: bool = True
    turnaround_s: float = 0.0
    usb_latency_s: float = 0.0
    poll_s: float = 1e-3


class PtyServer(Generic[Emulator]):
    """A thread that connects an emulator to a pseudo-terminal.

    Tests reach the device while it runs through `exclusive()`, and the line through `faults`, `unplug()` and
    `replug()`. Unplugging is like pulling the adapter: the host sees a hang-up, the device keeps its power.

    Args:
        emulator: The device.
        timing: How fast the line is.
        seed: Of the faults and of the garbage after a mismatch of line rates.
        link: Symbolic link to keep on the terminal's path, which changes whenever it is plugged in again.
        clock_ns: Monotonic clock.

    Attributes:
        faults: What goes wrong on the line.
    """

    def __init__(
        self,
        emulator: Emulator,
        timing: LineTiming | None = None,
        *,
        seed: int = 0,
        link: Path | None = None,
        clock_ns: Callable[[], int] = time.monotonic_ns,
    ) -> None:
        self.faults = FaultInjector(np.random.default_rng(seed))
        self._emulator, self._timing, self._clock_ns = emulator, timing or LineTiming(), clock_ns
        self._link = link
        self._lock = threading.Lock()
        self._line: PtyLine | None = None
        self._thread: threading.Thread | None = None
        self._wake_read = self._wake_write = -1
        self._stopping = False
        self._rx: deque[tuple[int, bytes]] = deque()
        self._tx: deque[tuple[int, bytes]] = deque()
        self._rx_clear_ns = self._tx_clear_ns = self._polled_ns = 0

    @property
    def path(self) -> str:
        """What the host opens: the link, if there is one, or the terminal. OSError while unplugged."""
        if self._line is None:
            raise OSError("the emulated port is not plugged in")
        return str(self._link) if self._link is not None else self._line.path

    def start(self) -> str:
        """Plug in and serve; returns `path`."""
        if self._thread is not None:
            raise RuntimeError("the server is running")
        self._wake_read, self._wake_write = os.pipe()
        self._stopping = False
        try:
            path = self.replug()
        except OSError:
            self._close()
            raise
        self._thread = threading.Thread(target=self._serve, name="serial-emulator", daemon=True)
        self._thread.start()
        return path

    def stop(self) -> None:
        """Unplug, end the thread and close everything; harmless if it is not running."""
        if self._thread is None:
            return
        self._stopping = True
        self._wake()
        self._thread.join()
        self._thread = None
        self._close()

    def __enter__(self) -> PtyServer[Emulator]:
        self.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()

    @contextmanager
    def exclusive(self) -> Iterator[Emulator]:
        """The emulator, while the server's thread keeps its hands off it."""
        with self._lock:
            yield self._emulator

    def unplug(self) -> None:
        """Hang up; bytes under way are lost. Harmless if unplugged."""
        with self._lock:
            line, self._line = self._line, None
            self._rx.clear()
            self._tx.clear()
            if line is not None:
                line.close()
                self._unlink()
                self._wake()  # a select in progress keeps the terminal alive

    def replug(self) -> str:
        """Plug in (a new terminal, the same link); returns `path`. The server must be running."""
        if self._wake_write < 0:
            raise RuntimeError("the server is not running")
        with self._lock:
            if self._line is None:
                self._line = PtyLine(self._emulator.baud)
                self._rx_clear_ns = self._tx_clear_ns = self._clock_ns()
                if self._link is not None:
                    self._unlink()
                    self._link.symlink_to(self._line.path)
        self._wake()
        return self.path

    def _close(self) -> None:
        self.unplug()
        os.close(self._wake_read)
        os.close(self._wake_write)
        self._wake_read = self._wake_write = -1

    def _unlink(self) -> None:
        if self._link is not None and self._link.is_symlink():
            self._link.unlink()

    def _wake(self) -> None:
        os.write(self._wake_write, b"\0")

    def _serve(self) -> None:
        while not self._stopping:
            with self._lock:
                self._step()
                fds = [self._wake_read] if self._line is None else [self._wake_read, self._line.master]
                timeout_s = max(0, self._next_event_ns() - self._clock_ns() - _WAKES_LATE_NS) / _NS
            try:
                ready, _, _ = select.select(fds, [], [], timeout_s)
            except OSError:
                continue  # the terminal was closed between the lock and the call
            if self._wake_read in ready:
                os.read(self._wake_read, _READ_SIZE)
            with self._lock:
                if self._line is not None and self._line.master in ready:
                    self._receive(self._line)

    def _next_event_ns(self) -> int:
        """When the thread must wake: the poll, the next delivery, or received bytes that are through the line."""
        due_ns = self._polled_ns + round(self._timing.poll_s * _NS)
        if self._tx and self._line is not None:
            due_ns = min(due_ns, self._tx[0][0])
        if self._rx:
            # A wake-up for each byte would cost more than it is worth: take them in grains.
            due_ns = min(due_ns, max(self._rx[0][0], min(self._rx[-1][0], self._rx[0][0] + _RX_GRAIN_NS)))
        return due_ns

    def _receive(self, line: PtyLine) -> None:
        """Take what the host has written and let each byte pass the line in its time."""
        data = line.read(_READ_SIZE)
        if not data:
            return
        baud, host_baud = self._emulator.baud, line.host_baud()
        if not same_rate(host_baud, baud):
            data = self.faults.garbage(data, baud / host_baud)
        byte_ns = self._byte_ns(baud)
        at_ns = max(self._rx_clear_ns, self._clock_ns())
        for byte in self.faults.on_command(data):
            at_ns += byte_ns
            self._rx.append((at_ns, bytes([byte])))
        self._rx_clear_ns = at_ns

    def _step(self) -> None:
        """Everything that is due now: bytes in, time passing in the device, bytes out."""
        now_ns = self._clock_ns()
        while self._rx and self._rx[0][0] <= now_ns:
            at_ns, data = self._rx.popleft()
            baud = self._emulator.baud
            # A reply to a change of the rate still goes out at the old one.
            self._send(self._emulator.feed(data, at_ns), at_ns + round(self._timing.turnaround_s * _NS), baud)
        baud = self._emulator.baud
        self._send(self._emulator.advance(now_ns), now_ns, baud)
        self._polled_ns = now_ns
        while self._line is not None and self._tx and self._tx[0][0] <= now_ns:
            self._line.write(self._tx.popleft()[1])

    def _send(self, reply: bytes, start_ns: int, baud: int) -> None:
        """Put bytes on the line to the host; they become readable when the last of them has arrived."""
        if not reply or self._line is None:
            return
        host_baud = self._line.host_baud()
        for delivery in self.faults.on_reply(reply):
            matched = same_rate(host_baud, baud)
            data = delivery.data if matched else self.faults.garbage(delivery.data, host_baud / baud)
            start_ns = max(start_ns + delivery.delay_ns, self._tx_clear_ns)
            self._tx_clear_ns = start_ns + len(delivery.data) * self._byte_ns(baud)
            self._tx.append((self._handed_over_ns(self._tx_clear_ns, len(data)), data))

    def _handed_over_ns(self, arrived_ns: int, size: int) -> int:
        """When a USB adapter hands bytes to the host: when its timer next ends, or at once if a packet is full."""
        latency_ns = round(self._timing.usb_latency_s * _NS)
        if latency_ns == 0:
            return arrived_ns
        due_ns = -(-arrived_ns // latency_ns) * latency_ns
        waiting = size + sum(len(data) for at_ns, data in self._tx if at_ns >= due_ns)
        if waiting < _FTDI_PACKET:
            return due_ns
        for index, (at_ns, data) in enumerate(self._tx):
            self._tx[index] = (min(at_ns, arrived_ns), data)
        return arrived_ns

    def _byte_ns(self, baud: int) -> int:
        return _BITS_PER_BYTE * _NS // baud if self._timing.paced else 0
