"""What the receive thread leaves for the cycle: copies, under one lock, and no more than the newest of each.

The subscribers copy and count; they decide nothing and cannot fail, because ``canopen`` would only log it.
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
    """One EMCY message: its code (0x00xx clears), the error register (object 0x1001), five bytes of the maker's own."""

    code: int
    register: int
    vendor: bytes


@dataclass(slots=True)
class NodeBox:
    """Latest data of one node; the cycle receives copies.

    Attributes:
        answered: The newest SYNC, in time. A later answer cannot be told from one to the next SYNC, because process
            data carry no number.
        nmt_state: As its newest heartbeat has it; None before the first one.
        active: EMCY messages of errors that were not cleared.
    """

    node: int
    tpdo: bytes | None = None
    answered: bool = False
    heartbeat_ns: int = 0
    nmt_state: int | None = None
    boots: int = 0
    active: tuple[Emergency, ...] = ()


class Mailbox:
    """The boxes of all nodes."""

    def __init__(self, nodes: Sequence[int], tpdo_bytes: int, now_ns: Callable[[], int]) -> None:
        self._boxes = {node: NodeBox(node, heartbeat_ns=now_ns()) for node in nodes}
        self._tpdo_bytes = tpdo_bytes
        self._now_ns = now_ns
        self._waiting = False
        self._missing = 0
        self._all_here = threading.Condition()

    def on_tpdo(self, identifier: int, data: bytearray, _timestamp: float) -> None:
        """Subscriber of process data."""
        with self._all_here:
            box = self._boxes[identifier & 0x7F]
            if len(data) != self._tpdo_bytes:
                return
            box.tpdo = bytes(data)
            if self._waiting and not box.answered:
                box.answered = True
                self._missing -= 1
                if self._missing == 0:
                    self._all_here.notify_all()

    def on_heartbeat(self, identifier: int, data: bytearray, _timestamp: float) -> None:
        """Subscriber of heartbeats and boot-up messages."""
        time_ns = self._now_ns()
        with self._all_here:
            box = self._boxes[identifier & 0x7F]
            if len(data) != 1:
                return
            box.heartbeat_ns, box.nmt_state = time_ns, data[0] & 0x7F
            box.boots += data[0] == 0

    def on_emcy(self, identifier: int, data: bytearray, _timestamp: float) -> None:
        """Subscriber of EMCY messages."""
        with self._all_here:
            box = self._boxes[identifier & 0x7F]
            if len(data) != _EMCY.size:
                return
            emergency = Emergency(*_EMCY.unpack(data))
            clears = emergency.code & 0xFF00 == 0
            box.active = () if clears else (*box.active[-_EMCY_KEPT:], emergency)

    def begin(self) -> None:
        """Note that a SYNC follows: process data from now on answer it."""
        with self._all_here:
            for box in self._boxes.values():
                box.answered = False
            self._missing = len(self._boxes)
            self._waiting = True

    def wait(self, deadline_ns: int) -> tuple[NodeBox, ...]:
        """Wait until every node has answered or until the deadline; return copies of all boxes."""
        with self._all_here:
            while self._missing > 0:
                remaining_ns = deadline_ns - self._now_ns()
                if remaining_ns <= 0:
                    break
                self._all_here.wait(remaining_ns * _NS)
            self._waiting = False
            return self._copies()

    def look(self) -> tuple[NodeBox, ...]:
        """Return copies of all boxes."""
        with self._all_here:
            return self._copies()

    def start_over(self) -> None:
        """Forget what was said before the nodes were set up: boots, errors, NMT states; heartbeats count from now."""
        with self._all_here:
            for box in self._boxes.values():
                box.boots, box.active, box.nmt_state, box.heartbeat_ns = 0, (), None, self._now_ns()

    def _copies(self) -> tuple[NodeBox, ...]:
        return tuple(replace(box) for box in self._boxes.values())
