"""The way to the board: a CAN bus with its codec. It starts no thread."""

from collections.abc import Iterable
from dataclasses import replace
from typing import Final

from palpate.drivers.can import CanLink
from palpate.drivers.jr3.codec import CanDecoder, Reassembly, encode_can
from palpate.drivers.jr3.messages import Forces, Message, Moments, Request, TransportCounts
from palpate.drivers.jr3.settings import check_node

ACK_TIMEOUT_NS: Final = 250_000_000
ATTEMPTS: Final = 3
PING_ATTEMPTS: Final = 16
"""FACT: yarp-devices waits 0.25 s for an answer; the board boots in 2 s, so the first request is made more often."""
MIN_PERIOD_US: Final = 540
"""CALC: two frames last 0.27 ms; half the bus is left free."""


class CanTransport:
    """The board on a CAN bus.

    Raises:
        SettingError: The node number cannot work (:func:`palpate.drivers.jr3.settings.check_node`).
    """

    def __init__(self, link: CanLink, node: int = 1, canopen_nodes: Iterable[int] = ()) -> None:
        check_node(node, canopen_nodes)
        self.name = f"JR3 on CAN, node {node}"
        self._link, self._node = link, node
        self._decoder, self._joiner = CanDecoder(node), Reassembly()

    def receive(self) -> list[Message]:
        """Messages that have arrived; halves of readings are joined."""
        messages: list[Message] = []
        for frame in self._link.receive():
            message = self._decoder.decode(frame)
            whole = self._joiner.add(message) if isinstance(message, (Forces, Moments)) else message
            if whole is not None:
                messages.append(whole)
        return messages

    def send(self, request: Request) -> bool:
        """Send a request; False when the interface did not take it."""
        return self._link.send(encode_can(request, self._node))

    def forget(self) -> None:
        """Drop halves of readings."""
        self._joiner.clear()

    def counts(self) -> TransportCounts:
        """What was seen so far."""
        seen, link = self._decoder.counts, self._link
        return replace(
            seen,
            garbage=seen.garbage + link.garbled,
            orphans=self._joiner.orphans,
            duplicates=self._joiner.duplicates,
            bus_offs=link.bus_offs,
        )
