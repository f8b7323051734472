"""An emulated CAN bus: its frames and nodes, arbitration, and the time a frame takes."""

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol


@dataclass(frozen=True, slots=True)
class BusFrame:
    """One classic CAN data frame with an 11-bit identifier.

    Attributes:
        arbitration_id: Identifier, 0 to 0x7FF; the lower one wins arbitration.
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


DEFAULT_BIT_RATE_Hz = 1_000_000
"""Bit rate of a JR3 node. FACT: jr3-mbed-firmware-can README."""


OUTBOX_FRAMES = 256
"""Frames a device keeps while the bus is busy; further ones are lost. assumed, and more than the three transmit buffers
of a real node, because a server that was held up hands in many frames at once."""


def frame_bits(payload_bytes: int) -> int:
    """Length on the wire of a data frame with an 11-bit identifier, in bits.

    CALC: 47 bits with the space after the frame, 8 for each byte, and half of the most stuff bits there can be, so
    that 8 bytes take 123 of 111 to 135 bits. Half of them is assumed.
    """
    return 47 + 8 * payload_bytes + (33 + 8 * payload_bytes) // 8


@dataclass(frozen=True, slots=True)
class _OnWire:
    sender: int
    frame: BusFrame


class EmulatedCanBus:
    """A bus with emulated nodes and one host, without any input or output of its own.

    One frame is on the wire at a time. Of the devices that have one ready when it falls free, that with the lowest
    identifier goes first; each device keeps the order of its own frames. A frame is received by all but its sender
    when its last bit is over. On a bus with more frames than it can carry, devices lose their newest ones.

    Raises:
        ValueError: If the bit rate is not positive.
    """

    def __init__(self, nodes: Sequence[CanNode], *, bit_rate_Hz: int = DEFAULT_BIT_RATE_Hz) -> None:
        if bit_rate_Hz <= 0:
            raise ValueError(f"bit_rate_Hz: a positive number expected, got {bit_rate_Hz}")
        self.bit_rate_Hz = bit_rate_Hz
        self.frames_carried = 0
        """Frames that went over the wire, whatever arrived of them."""
        self.frames_refused = 0
        """Frames that were lost because their sender could not get rid of them."""
        self._nodes = tuple(nodes)
        self._ready: list[deque[tuple[int, BusFrame]]] = [deque() for _ in range(len(self._nodes) + 1)]
        self._host = len(self._nodes)
        self._on_wire: _OnWire | None = None
        self._free_ns = 0

    def send(self, frame: BusFrame, now_ns: int) -> None:
        """Take a frame of the host for transmission."""
        self._queue(self._host, [frame], now_ns)

    def advance(self, now_ns: int) -> list[BusFrame]:
        """Let time pass; frames the host received meanwhile, in order.

        Args:
            now_ns: Time to go to, ns; never before an earlier one.
        """
        for sender, node in enumerate(self._nodes):
            if frames := node.advance(now_ns):
                self._queue(sender, frames, now_ns)
        heard: list[BusFrame] = []
        while True:
            if self._on_wire is None:
                self._on_wire = self._begin(now_ns)
            if self._on_wire is None or self._free_ns > now_ns:
                return heard
            heard += self._finish(self._on_wire, now_ns)
            self._on_wire = None

    def _queue(self, sender: int, frames: Sequence[BusFrame], now_ns: int) -> None:
        room = max(0, OUTBOX_FRAMES - len(self._ready[sender]))
        self.frames_refused += max(0, len(frames) - room)
        for frame in frames[:room]:
            self._ready[sender].append((now_ns, frame))

    def _begin(self, now_ns: int) -> _OnWire | None:
        heads = [(queue[0], sender) for sender, queue in enumerate(self._ready) if queue]
        if not heads:
            return None
        start_ns = max(self._free_ns, min(ready_ns for (ready_ns, _), _ in heads))
        if start_ns > now_ns:
            return None
        contenders = [(frame.arbitration_id, sender) for (ready_ns, frame), sender in heads if ready_ns <= start_ns]
        _, winner = min(contenders)
        _, frame = self._ready[winner].popleft()
        self._free_ns = start_ns + frame_bits(len(frame.data)) * 1_000_000_000 // self.bit_rate_Hz
        return _OnWire(winner, frame)

    def _finish(self, sent: _OnWire, now_ns: int) -> list[BusFrame]:
        self.frames_carried += 1
        for receiver, node in enumerate(self._nodes):
            if receiver != sent.sender:
                # The nodes are already at the present, and time must not run backwards for them.
                self._queue(receiver, node.feed(sent.frame.arbitration_id, sent.frame.data, now_ns), now_ns)
        return [] if sent.sender == self._host else [sent.frame]
