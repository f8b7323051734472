"""A bus cycle with set-points, SYNC and replies, and the interpretation of each joint's reply."""

import contextlib
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Final

from palpate.drivers.cia402 import codec
from palpate.drivers.cia402.link import CanopenLink
from palpate.drivers.cia402.mailbox import Mailbox, NodeBox
from palpate.drivers.cia402.monitor import AxisView
from palpate.drivers.cia402.settings import ANSWER_SHARE, ArmSettings
from palpate.drivers.errors import SilentError

_HEARTBEATS_PER_WATCHDOG: Final = 3


class CyclicExchange:
    """Cyclic communication with all drives. It stores no arm state and makes no decisions.

    Set-points reach the bus before their SYNC only if the adapter preserves frame order. If an adapter sorts its
    transmit buffers by identifier, the SYNC (0x080) overtakes the set-points, which take effect one cycle later
    (INFERENCE from how arbitration works; not measured).

    Attributes:
        views: Joint states at the last SYNC; empty before the first SYNC.
    """

    def __init__(self, link: CanopenLink, settings: ArmSettings, now_ns: Callable[[], int]) -> None:
        self._link, self._settings, self._now_ns = link, settings, now_ns
        self._nodes = [joint.node for joint in settings.joints]
        self._mailbox = Mailbox(self._nodes, codec.TPDO.size, now_ns)
        self._deadline_ns = int(settings.period_ns * ANSWER_SHARE)
        self._last_heartbeat_ns = 0
        self._unheard_until_ns: int | None = None
        self.cycles = 0
        self.missing = [0] * len(self._nodes)
        self.views: tuple[AxisView, ...] = ()
        self.targets: tuple[int, ...] = (0,) * len(self._nodes)
        self.sync_ns = 0
        self.heartbeat_on = False

    def listen(self) -> None:
        """Start listening to the nodes."""
        for node in self._nodes:
            self._link.subscribe(codec.TPDO1 + node, self._mailbox.on_tpdo)
            self._link.subscribe(codec.HEARTBEAT + node, self._mailbox.on_heartbeat)
            self._link.subscribe(codec.EMCY + node, self._mailbox.on_emcy)

    def unsubscribe(self) -> None:
        """Stop listening to the nodes."""
        for node in self._nodes:
            for service in (codec.TPDO1, codec.HEARTBEAT, codec.EMCY):
                self._link.unsubscribe(service + node)

    def all_operational(self) -> bool:
        """Return True if each node's latest heartbeat reports the operational state."""
        return all(box.nmt_state == codec.NMT_OPERATIONAL for box in self._mailbox.look())

    def start_over(self) -> None:
        """Clear data received before the drives were configured."""
        self._mailbox.start_over()
        self.views = ()

    def command_nmt(self, command: int) -> None:
        """Send an NMT command to each drive separately, so that it does not affect other devices on the bus."""
        for node in self._nodes:
            self._link.send(codec.NMT, bytes((command, node)))

    def hold(self) -> tuple[int, ...]:
        """Return targets that cause no motion: each joint's latest position."""
        return tuple(view.counts or 0 for view in self.views) or (0,) * len(self._nodes)

    def run(self, controlwords: Sequence[int], targets: Sequence[int]) -> tuple[AxisView, ...]:
        """Run one cycle: send set-points in counts and the SYNC, then wait for all replies until the deadline."""
        self._link.require_alive()
        if self._unheard_until_ns is not None:
            # A broadcast does not wait, so replies to its SYNC must not count as replies to the next SYNC.
            self._mailbox.wait(self._unheard_until_ns)
            self._unheard_until_ns = None
        begin_ns = self._now_ns()
        every_ns = self._settings.host_watchdog_ms * 1_000_000 // _HEARTBEATS_PER_WATCHDOG
        if self.heartbeat_on and begin_ns - self._last_heartbeat_ns >= every_ns:
            self._link.send(codec.HEARTBEAT + self._settings.host_node, bytes((codec.NMT_OPERATIONAL,)))
            self._last_heartbeat_ns = begin_ns
        self.targets = tuple(targets)
        for node, controlword, target in zip(self._nodes, controlwords, targets, strict=True):
            self._link.send(codec.RPDO1 + node, codec.RPDO.pack(controlword, target))
        self._mailbox.begin()
        sync_ns = self._now_ns()
        self._link.send(codec.SYNC, b"")
        boxes = self._mailbox.wait(sync_ns + self._deadline_ns)
        self.cycles += 1
        self.missing = [count + (not box.answered) for count, box in zip(self.missing, boxes, strict=True)]
        self._read(boxes, sync_ns)
        return self.views

    def broadcast(self, controlword: int) -> None:
        """Send a controlword, targets that hold the position, and a SYNC, without waiting and despite errors."""
        for node, target in zip(self._nodes, self.hold(), strict=True):
            # An error at one drive must not prevent the command to the next.
            with contextlib.suppress(SilentError):
                self._link.send(codec.RPDO1 + node, codec.RPDO.pack(controlword, target))
        self._mailbox.begin()
        self._unheard_until_ns = self._now_ns() + self._deadline_ns
        with contextlib.suppress(SilentError):
            self._link.send(codec.SYNC, b"")

    def _read(self, boxes: tuple[NodeBox, ...], sync_ns: int) -> None:
        self.sync_ns = sync_ns
        before = self.views or (None,) * len(boxes)
        self.views = tuple(self._view(i, box, old) for i, (box, old) in enumerate(zip(boxes, before, strict=True)))

    def _view(self, axis: int, box: NodeBox, old: AxisView | None) -> AxisView:
        if not box.answered or box.tpdo is None:
            missed = 1 if old is None else old.missed_in_a_row + 1
            if old is None:
                return AxisView(box, None, None, None, None, 0, missed)
            return replace(old, box=box, missed_in_a_row=missed)
        statusword, counts, mode = codec.TPDO.unpack(box.tpdo)
        position_rad = self._settings.joints[axis].angle_rad(counts)
        moved = 0 if old is None or old.counts is None else counts - old.counts
        return AxisView(box, statusword, codec.state_of(statusword), counts, position_rad, moved, 0, mode)
