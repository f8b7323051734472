"""What the receive thread leaves for the cycle: copies, under one lock, and no more than the newest of each.

The subscribers copy and count; they decide nothing and cannot fail, because ``canopen`` would only log it.
"""

import struct
import threading
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Final

_EMCY: Final = struct.Struct("<HB5s")
_EMCY_KEPT: Final = 64
_NS: Final = 1e-9


@dataclass(frozen=True, slots=True)
class Emergency:
    """One EMCY message.

    Attributes:
        code: Error code; 0x00xx says that there is no error any more.
        register: The error register, object 0x1001.
        vendor: Five bytes of the maker's own.
    """

    node: int
    code: int
    register: int
    vendor: bytes
    time_ns: int

    @property
    def clears(self) -> bool:
        """Whether it says that the errors are gone."""
        return self.code & 0xFF00 == 0


@dataclass(slots=True)
class NodeBox:
    """What is known about one node; the cycle gets copies.

    Attributes:
        answers: To the newest SYNC.
        missed: SYNCs that were not answered in time.
        late: Answers that came after their deadline and before the next SYNC. Later ones cannot be told from answers
            to the next SYNC, because process data carry no number.
        nmt_state: What it said; None before the first one.
        emergencies: EMCY messages that tell of an error.
    """

    node: int
    tpdo: bytes | None = None
    tpdo_ns: int = 0
    answers: int = 0
    missed: int = 0
    late: int = 0
    duplicates: int = 0
    malformed: int = 0
    heartbeat_ns: int = 0
    nmt_state: int | None = None
    boots: int = 0
    emergencies: int = 0
    active: tuple[Emergency, ...] = ()


@dataclass(frozen=True, slots=True)
class ArmStatistics:
    """Figures of the arm.

    Attributes:
        emergencies: The newest EMCY messages, oldest first.
    """

    cycles: int
    nodes: tuple[NodeBox, ...]
    emergencies: tuple[Emergency, ...]


class Mailbox:
    """The boxes of all nodes."""

    def __init__(self, nodes: Sequence[int], tpdo_bytes: int, now_ns: Callable[[], int]) -> None:
        self._boxes = {node: NodeBox(node, heartbeat_ns=now_ns()) for node in nodes}
        self._tpdo_bytes = tpdo_bytes
        self._now_ns = now_ns
        self._waiting = False
        self._missing = 0
        self._all_here = threading.Condition()
        self._emergencies: deque[Emergency] = deque(maxlen=_EMCY_KEPT)
        self._cycles = 0

    def on_tpdo(self, identifier: int, data: bytearray, _timestamp: float) -> None:
        """Subscriber of process data."""
        time_ns = self._now_ns()
        with self._all_here:
            box = self._boxes[identifier & 0x7F]
            if len(data) != self._tpdo_bytes:
                box.malformed += 1
                return
            box.tpdo, box.tpdo_ns = bytes(data), time_ns
            box.answers += 1
            if box.answers > 1:
                box.duplicates += 1
            elif not self._waiting:
                box.late += 1
            else:
                self._missing -= 1
                if self._missing == 0:
                    self._all_here.notify_all()

    def on_heartbeat(self, identifier: int, data: bytearray, _timestamp: float) -> None:
        """Subscriber of heartbeats and boot-up messages."""
        time_ns = self._now_ns()
        with self._all_here:
            box = self._boxes[identifier & 0x7F]
            if len(data) != 1:
                box.malformed += 1
                return
            box.heartbeat_ns, box.nmt_state = time_ns, data[0] & 0x7F
            box.boots += data[0] == 0

    def on_emcy(self, identifier: int, data: bytearray, _timestamp: float) -> None:
        """Subscriber of EMCY messages."""
        time_ns = self._now_ns()
        with self._all_here:
            box = self._boxes[identifier & 0x7F]
            if len(data) != _EMCY.size:
                box.malformed += 1
                return
            code, register, vendor = _EMCY.unpack(data)
            emergency = Emergency(box.node, code, register, vendor, time_ns)
            self._emergencies.append(emergency)
            if emergency.clears:
                box.active = ()
            else:
                box.emergencies += 1
                box.active = (*box.active[-_EMCY_KEPT:], emergency)

    def begin(self) -> None:
        """Right before a SYNC: from now on process data answer it."""
        with self._all_here:
            for box in self._boxes.values():
                box.answers = 0
            self._missing = len(self._boxes)
            self._waiting = True

    def wait(self, deadline_ns: int) -> tuple[NodeBox, ...]:
        """Wait until every node has answered, or the deadline; then copies of all boxes."""
        with self._all_here:
            while self._missing > 0:
                remaining_ns = deadline_ns - self._now_ns()
                if remaining_ns <= 0:
                    break
                self._all_here.wait(remaining_ns * _NS)
            self._waiting = False
            return self._copies()

    def look(self) -> tuple[NodeBox, ...]:
        """Copies of all boxes as they are."""
        with self._all_here:
            return self._copies()

    def count(self, boxes: Sequence[NodeBox]) -> None:
        """Take down the result of a cycle: the boxes that :meth:`wait` gave."""
        with self._all_here:
            self._cycles += 1
            for box in boxes:
                self._boxes[box.node].missed += box.answers == 0

    def statistics(self) -> ArmStatistics:
        """All figures so far."""
        with self._all_here:
            return ArmStatistics(self._cycles, self._copies(), tuple(self._emergencies))

    def start_over(self) -> None:
        """Forget what was said before the nodes were set up: boots, errors, NMT states; heartbeats count from now."""
        with self._all_here:
            for box in self._boxes.values():
                box.boots, box.active, box.nmt_state, box.heartbeat_ns = 0, (), None, self._now_ns()

    def _copies(self) -> tuple[NodeBox, ...]:
        return tuple(replace(box) for box in self._boxes.values())
