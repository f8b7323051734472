"""What travels on an emulated CAN bus, and what every emulated node can do with it."""

from dataclasses import dataclass
from typing import Protocol


@dataclass(frozen=True, slots=True)
class CanFrame:
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

    def feed(self, arbitration_id: int, data: bytes, now_ns: int) -> list[CanFrame]:
        """Hand the node one frame seen on the bus and return what it answers at once."""
        ...

    def advance(self, now_ns: int) -> list[CanFrame]:
        """Let time pass until ``now_ns`` and return what the node sent of its own accord."""
        ...
