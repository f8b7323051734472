"""Latest data from all nodes, copied from the receive thread to the cycle under one lock.

The subscribers only copy and count. They must not raise exceptions, because ``canopen`` would only log them.
"""

import struct
import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Final, NamedTuple

_EMCY: Final = struct.Struct("<HB5s")
_EMCY_KEPT: Final = 64
_NS: Final = 1e-9


class Emergency(NamedTuple):
    """EMCY message: error code (0x00xx clears errors), error register (object 0x1001) and five manufacturer bytes."""

    code: int
    register: int
    vendor: bytes


@dataclass(slots=True)
class NodeBox:
    """Latest data from one node; the cycle receives copies.

    Attributes:
        answered: True if the node answered the latest SYNC in time. A late reply cannot be distinguished from a
            reply to the next SYNC, because process data contain no sequence number.
        active: EMCY messages for errors that have not been cleared.
    """

    node: int
    tpdo: bytes | None = None
    answered: bool = False
    heartbeat_ns: int = 0
    nmt_state: int | None = None
    boots: int = 0
    active: tuple[Emergency, ...] = ()


class Mailbox:
    """Latest data from all nodes."""

    def __init__(self, nodes: Sequence[int], tpdo_bytes: int, now_ns: Callable[[], int]) -> None:
        self._boxes = {node: NodeBox(node, heartbeat_ns=now_ns()) for node in nodes}
        self._tpdo_bytes = tpdo_bytes
        self._now_ns = now_ns
        self._missing = 0
        self._all_here = threading.Condition()

    def on_tpdo(self, identifier: int, data: bytearray, _timestamp: float) -> None:
        """Store process data."""
        with self._all_here:
            box = self._boxes[identifier & 0x7F]
            if len(data) != self._tpdo_bytes:
                return
            box.tpdo = bytes(data)
            if not box.answered:
                box.answered = True
                self._missing -= 1
                if self._missing == 0:
                    self._all_here.notify_all()

    def on_heartbeat(self, identifier: int, data: bytearray, _timestamp: float) -> None:
        """Store a heartbeat or boot-up message."""
        time_ns = self._now_ns()
        with self._all_here:
            box = self._boxes[identifier & 0x7F]
            if len(data) != 1:
                return
            box.heartbeat_ns, box.nmt_state = time_ns, data[0] & 0x7F
            box.boots += data[0] == 0

    def on_emcy(self, identifier: int, data: bytearray, _timestamp: float) -> None:
        """Store an EMCY message."""
        with self._all_here:
            box = self._boxes[identifier & 0x7F]
            if len(data) != _EMCY.size:
                return
            emergency = Emergency(*_EMCY.unpack(data))
            clears = emergency.code & 0xFF00 == 0
            box.active = () if clears else (*box.active[-_EMCY_KEPT:], emergency)

    def begin(self) -> None:
        """Prepare for a SYNC: process data received from now on count as replies to this SYNC."""
        with self._all_here:
            for box in self._boxes.values():
                box.answered = False
            self._missing = len(self._boxes)

    def wait(self, deadline_ns: int) -> tuple[NodeBox, ...]:
        """Wait until every node has answered or until the deadline; return copies of all boxes."""
        with self._all_here:
            while self._missing > 0:
                remaining_ns = deadline_ns - self._now_ns()
                if remaining_ns <= 0:
                    break
                self._all_here.wait(remaining_ns * _NS)
            return self._copies()

    def look(self) -> tuple[NodeBox, ...]:
        """Return copies of all boxes."""
        with self._all_here:
            return self._copies()

    def start_over(self) -> None:
        """Clear the boot count, errors and NMT state of every node, and restart the heartbeat time-outs."""
        with self._all_here:
            for box in self._boxes.values():
                box.boots, box.active, box.nmt_state, box.heartbeat_ns = 0, (), None, self._now_ns()

    def _copies(self) -> tuple[NodeBox, ...]:
        return tuple(replace(box) for box in self._boxes.values())
