"""An emulated CAN bus: its frames and nodes. Frames take no time and reach everybody in the order they were sent."""

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol


@dataclass(frozen=True, slots=True)
class BusFrame:
    """One classic CAN data frame with an 11-bit identifier.

    Attributes:
        arbitration_id: Identifier, 0 to 0x7FF.
        data: Payload, 0 to 8 bytes.
    """

    arbitration_id: int
    data: bytes


class CanNode(Protocol):
    """A device on the bus, without any input or output of its own.

    Both methods receive the time of the bus in nanoseconds, which never runs backwards, and return
    the frames the device puts on the bus, in order. A node never reads a clock.
    """

    def feed(self, arbitration_id: int, data: bytes, now_ns: int) -> list[BusFrame]:
        """Hand the node one frame seen on the bus and return what it answers at once."""
        ...

    def advance(self, now_ns: int) -> list[BusFrame]:
        """Let time pass until ``now_ns`` and return what the node sent of its own accord."""
        ...


class EmulatedCanBus:
    """A bus with emulated nodes and one host, without any input or output of its own.

    A frame is received by all but its sender. There is neither arbitration nor a limit to what the bus carries.

    Args:
        bit_rate_Hz: Rate that a host has to set to hear anything.
    """

    def __init__(self, nodes: Sequence[CanNode], *, bit_rate_Hz: int = 1_000_000) -> None:
        self.bit_rate_Hz = bit_rate_Hz
        self._nodes = tuple(nodes)
        self._sent: deque[tuple[CanNode | None, BusFrame]] = deque()

    def send(self, frame: BusFrame) -> None:
        """Take a frame of the host; it reaches the nodes when time goes on."""
        self._sent.append((None, frame))

    def advance(self, now_ns: int) -> list[BusFrame]:
        """Let time pass; frames that the host receives, in order.

        Args:
            now_ns: Time to go to, ns; never before an earlier one.
        """
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
