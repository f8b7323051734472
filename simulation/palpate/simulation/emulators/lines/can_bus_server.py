"""Emulated CAN nodes in real time: the loop that servers of a bus share."""

import time
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable
from threading import Event, Thread
from typing import Self

from palpate.simulation.emulators.lines.can_bus import BusFrame, EmulatedCanBus

DEFAULT_TICK_s = 0.0005
"""Longest pause between two looks at the nodes, s."""

Action = Callable[[int], None]
"""Something to do in the server's thread at a time in ns, such as to reboot a node or change its faults."""


class CanBusServer(ABC):
    """Moves the wire along with a clock, in a thread of its own.

    Only that thread touches wire and nodes; whoever wants to act on them meanwhile hands in an `Action`. It looks at
    the nodes every `tick_s` at least.
    """

    def __init__(
        self, wire: EmulatedCanBus, *, tick_s: float = DEFAULT_TICK_s, clock_ns: Callable[[], int] = time.monotonic_ns
    ) -> None:
        self.wire = wire
        self._tick_s, self._clock_ns = tick_s, clock_ns
        self._actions: deque[Action] = deque()
        self._closing = Event()
        self._thread = Thread(target=self._run, name=type(self).__name__, daemon=True)

    def start(self) -> Self:
        """Begin to serve; power comes up on all nodes now."""
        self._thread.start()
        return self

    def close(self) -> None:
        """End the thread and give everything back; may be called twice."""
        self._closing.set()
        if self._thread.is_alive():
            self._thread.join()
        self._release()

    def __enter__(self) -> Self:
        return self.start()

    def __exit__(self, *_: object) -> None:
        self.close()

    def post(self, action: Action) -> None:
        """Have something done in the server's thread before its next look at the nodes."""
        self._actions.append(action)

    def do(self, action: Action, timeout_s: float = 5.0) -> None:
        """Have something done in the server's thread and wait for it."""
        done = Event()

        def act(now_ns: int) -> None:
            action(now_ns)
            done.set()

        self.post(act)
        if not done.wait(timeout_s):
            raise TimeoutError("the bus server did not respond")

    def _run(self) -> None:
        while not self._closing.is_set():
            self.turn(self._tick_s)

    def turn(self, timeout_s: float = 0.0) -> None:
        """One look at host and nodes, in whose thread this is called; a server that was started does it by itself."""
        received = self._receive(timeout_s)
        now_ns = self._clock_ns()
        while self._actions:
            self._actions.popleft()(now_ns)
        for frame in received:
            self.wire.send(frame, now_ns)
        self._transmit(self.wire.advance(now_ns))

    @abstractmethod
    def _receive(self, timeout_s: float) -> list[BusFrame]:
        """Wait until the host sends something, at most for a while, and return its frames."""

    @abstractmethod
    def _transmit(self, frames: list[BusFrame]) -> None:
        """Hand frames to the host."""

    @abstractmethod
    def _release(self) -> None:
        """Give back what the server holds open."""
