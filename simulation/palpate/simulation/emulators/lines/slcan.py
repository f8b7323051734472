"""A USB-CAN adapter that speaks slcan on a pseudo-terminal, with emulated nodes on its bus."""

import contextlib
import os
import re
import select
import time
from collections import deque
from collections.abc import Callable
from threading import Event, Thread
from typing import Final, Self

from palpate.simulation.emulators.lines.can_bus import BusFrame, EmulatedCanBus
from palpate.simulation.emulators.lines.pty_server import PtyLine

DONE, ERROR = b"\r", b"\a"
BIT_RATES_Hz: Final = dict(
    zip(b"012345678", (10_000, 20_000, 50_000, 100_000, 125_000, 250_000, 500_000, 800_000, 1_000_000), strict=True)
)
"""Bit rates of the S command. FACT: LAWICEL CANUSB manual; python-can's slcan takes 7 for 750 kbit/s."""
LONGEST_LINE_BYTES: Final = 31
"""Longest classic frame: T, 8 digits, length, 16 digits, and some room for a time stamp. CALC."""
BACKLOG_BYTES: Final = 16_384
"""What the adapter keeps for a host that does not read, bytes; later frames are lost. assumed."""
_FRAME: Final = re.compile(rb"t([0-7][0-9a-fA-F]{2})([0-8])((?:[0-9a-fA-F]{2})*)")
_READ_BYTES: Final = 4096

Action = Callable[[int], None]
"""Something to do in the server's thread at a time in ns, such as to reboot a node."""


def frame_line(frame: BusFrame) -> bytes:
    """Line by which the adapter passes a received frame to the host."""
    return b"t%03X%d" % (frame.arbitration_id, len(frame.data)) + frame.data.hex().upper().encode() + DONE


class Adapter:
    """Takes the host's bytes, answers them, and gives the frames that go on the bus.

    It knows what hosts need: S sets the bit rate, O opens, C closes, t sends a frame. Extended and remote frames are
    refused: no emulated node reacts to one. An empty line is passed over in silence (assumed; python-can sends one
    while it sets the bit rate).

    Attributes:
        is_open: Whether the channel is.
        bit_rate_Hz: What the host has set; None before.
    """

    def __init__(self) -> None:
        self.is_open = False
        self.bit_rate_Hz: int | None = None
        self._line = b""

    def take(self, data: bytes) -> tuple[bytes, list[BusFrame]]:
        """Take bytes from the host; gives the answer for it, and frames to send."""
        *lines, rest = (self._line + data).split(DONE)
        self._line = rest[: LONGEST_LINE_BYTES + 1]
        frames: list[BusFrame] = []
        answers = [self._execute(line, frames) for line in lines if line]
        return b"".join(answers), frames

    def _execute(self, line: bytes, frames: list[BusFrame]) -> bytes:
        if self.is_open and (found := _FRAME.fullmatch(line)) and len(found[3]) == 2 * int(found[2]):
            frames.append(BusFrame(int(found[1], 16), bytes.fromhex(found[3].decode())))
            return b"z" + DONE
        if line[:1] == b"S" and len(line) == 2 and not self.is_open and line[1] in BIT_RATES_Hz:
            self.bit_rate_Hz = BIT_RATES_Hz[line[1]]
        elif line == (b"C" if self.is_open else b"O"):
            self.is_open = not self.is_open
        else:
            return ERROR
        return DONE


class SlcanServer:
    """Serves the adapter at the path `channel`, for drivers in this or another process, in a thread of its own.

    Only that thread touches bus and nodes; others hand in an `Action`. An adapter that
    is set to another bit rate than the bus exchanges nothing with it.

    Attributes:
        channel: Path of the terminal to give to python-can.
        frames_lost: Frames that the host has missed because it did not read.
    """

    def __init__(
        self, wire: EmulatedCanBus, *, tick_s: float = 0.0005, clock_ns: Callable[[], int] = time.monotonic_ns
    ) -> None:
        self.wire, self.adapter, self.frames_lost = wire, Adapter(), 0
        self._tick_s, self._clock_ns = tick_s, clock_ns
        self._actions: deque[Action] = deque()
        self._closing = Event()
        self._thread = Thread(target=self._run, name=type(self).__name__, daemon=True)
        self._backlog = bytearray()
        self._line = PtyLine()
        self._master = self._line.master
        self.channel = self._line.path
        self._plugged = True

    def __enter__(self) -> Self:
        """Begin to serve; power comes up on all nodes now."""
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """End the thread and give everything back; may be called twice."""
        self._closing.set()
        if self._thread.is_alive():
            self._thread.join()
        self._pull()

    def do(self, action: Action, timeout_s: float = 5.0) -> None:
        """Have something done in the server's thread before its next look at the nodes, and wait for it."""
        done = Event()

        def act(now_ns: int) -> None:
            action(now_ns)
            done.set()

        self._actions.append(act)
        if not done.wait(timeout_s):
            raise TimeoutError("the bus server did not respond")

    def unplug(self) -> None:
        """Pull the cable: the host's terminal hangs up. The server cannot be plugged in again."""
        self.do(lambda _: self._pull())

    def inject(self, line: bytes) -> None:
        """Have any bytes sent to the host as they are."""
        self.do(lambda _: self._backlog.extend(line))

    def turn(self, timeout_s: float = 0.0) -> None:
        """One look at host and nodes, in whose thread this is called; a server that was started does it by itself."""
        received = self._receive(timeout_s)
        now_ns = self._clock_ns()
        while self._actions:
            self._actions.popleft()(now_ns)
        for frame in received:
            self.wire.send(frame)
        self._transmit(self.wire.advance(now_ns))

    def _run(self) -> None:
        while not self._closing.is_set():
            self.turn(self._tick_s)

    def _pull(self) -> None:
        if self._plugged:
            self._plugged = False
            self._line.close()

    def _on_bus(self) -> bool:
        return self.adapter.is_open and self.adapter.bit_rate_Hz == self.wire.bit_rate_Hz

    def _receive(self, timeout_s: float) -> list[BusFrame]:
        """Wait until the host sends something, at most for a while, and return its frames."""
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
                self.frames_lost += 1
            else:
                self._backlog += frame_line(frame)
        self._write()

    def _write(self) -> None:
        # A full terminal takes nothing or a part; the rest waits for its turn.
        with contextlib.suppress(BlockingIOError):
            while self._backlog:
                del self._backlog[: os.write(self._master, self._backlog)]
