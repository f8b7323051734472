"""A USB-CAN adapter on a pseudo-terminal, with emulated nodes on its bus."""

from __future__ import annotations

import contextlib
import os
import pty
import select
import time
import tty
from collections.abc import Callable

import numpy as np

from palpate.simulation.emulators.lines.can_bus_server import CanBusServer, DEFAULT_TICK_s
from palpate.simulation.emulators.lines.can_frame import CanFrame
from palpate.simulation.emulators.lines.can_wire import CanWire
from palpate.simulation.emulators.lines.slcan_codec import Adapter, Mode, frame_line
from palpate.simulation.emulators.lines.slcan_faults import FaultyLines

BACKLOG_BYTES = 16_384
"""What the adapter keeps for a host that does not read, bytes; later frames are lost. assumed."""

_READ_BYTES = 4096


class SlcanServer(CanBusServer):
    """Serves an slcan adapter at the path `channel`, for drivers in this or another process.

    An adapter that is set to another bit rate than the bus exchanges nothing with it.

    Args:
        wire: The bus with its nodes.
        generator: Source of random line faults.
        tick_s: Longest pause between two looks at the nodes, s.
        clock_ns: Monotonic clock.
    """

    def __init__(
        self,
        wire: CanWire,
        *,
        generator: np.random.Generator,
        tick_s: float = DEFAULT_TICK_s,
        clock_ns: Callable[[], int] = time.monotonic_ns,
    ) -> None:
        super().__init__(wire, tick_s=tick_s, clock_ns=clock_ns)
        self.adapter = Adapter()
        self.lines = FaultyLines(generator)
        """Knobs for malformed lines."""
        self.frames_lost = 0
        """Frames the host has missed because it did not read."""
        self._backlog = bytearray()
        # The slave side stays open here: without anybody on it, reading the master would fail between two hosts.
        self._master, self._slave = pty.openpty()
        tty.setraw(self._slave)
        os.set_blocking(self._master, False)
        self.channel = os.ttyname(self._slave)
        """Path of the terminal to give to python-can."""
        self._plugged = True

    @property
    def plugged(self) -> bool:
        """Whether the adapter is still there."""
        return self._plugged

    def unplug(self) -> None:
        """Pull the cable: the host's terminal hangs up. The server ends and cannot be plugged in again."""
        self.do(lambda _: self._pull())

    def inject(self, line: bytes) -> None:
        """Have any bytes sent to the host as they are."""
        self.do(lambda _: self._backlog.extend(line))

    def _pull(self) -> None:
        if self._plugged:
            self._plugged = False
            os.close(self._slave)
            os.close(self._master)

    def _on_bus(self) -> bool:
        return self.adapter.mode is not Mode.CLOSED and self.adapter.bit_rate_Hz == self.wire.bit_rate_Hz

    def _receive(self, timeout_s: float) -> list[CanFrame]:
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

    def _transmit(self, frames: list[CanFrame]) -> None:
        if not self._plugged:
            return
        for frame in frames if self._on_bus() else []:
            if len(self._backlog) > BACKLOG_BYTES:
                self.adapter.overrun = True
                self.frames_lost += 1
            else:
                self._backlog += self.lines.spoil(frame_line(frame))
        self._write()

    def _write(self) -> None:
        # A full terminal takes nothing or a part; the rest waits for its turn.
        with contextlib.suppress(BlockingIOError):
            while self._backlog:
                del self._backlog[: os.write(self._master, self._backlog)]

    def _release(self) -> None:
        self._pull()
