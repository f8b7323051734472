"""An emulated CAN bus with its frames and nodes. Frames take no time and reach all nodes in sending order."""

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol


@dataclass(frozen=True, slots=True)
class BusFrame:
    """A classic CAN data frame with an 11-bit identifier and 0 to 8 bytes."""

    arbitration_id: int
    data: bytes


class CanNode(Protocol):
    """A device on the bus, without I/O of its own.

    Both methods receive the bus time in nanoseconds, which never decreases, and return the frames that the device
    sends, in order. A node never reads a clock.
    """

    def feed(self, arbitration_id: int, data: bytes, now_ns: int) -> list[BusFrame]:
        """Pass a frame from the bus to the node and return its immediate replies."""
        ...

    def advance(self, now_ns: int) -> list[BusFrame]:
        """Advance the time to ``now_ns`` and return the frames that the node sent unprompted."""
        ...


class EmulatedCanBus:
    """A bus with emulated nodes, one host and a fixed bit rate, without I/O, arbitration or a load limit."""

    def __init__(self, nodes: Sequence[CanNode], *, bit_rate_Hz: int = 1_000_000) -> None:
        self.bit_rate_Hz = bit_rate_Hz
        self._nodes = tuple(nodes)
        self._sent: deque[tuple[CanNode | None, BusFrame]] = deque()

    def send(self, frame: BusFrame) -> None:
        """Accept a frame from the host. It reaches the nodes the next time the clock advances."""
        self._sent.append((None, frame))

    def advance(self, now_ns: int) -> list[BusFrame]:
        """Advance the time, which never decreases, and return the frames that the host receives, in order."""
        for node in self._nodes:
            self._sent += [(node, frame) for frame in node.advance(now_ns)]
        heard: list[BusFrame] = []
        while self._sent:
            sender, frame = self._sent.popleft()
            for node in self._nodes:
                if node is not sender:
                    answers = node.feed(frame.arbitration_id, frame.data, now_ns)
                    self._sent += [(node, answer) for answer in answers]
            if sender is not None:
                heard.append(frame)
        return heard
