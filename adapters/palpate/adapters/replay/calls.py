"""All port calls of a trial in their order: those of its log, and those that the core makes now."""

from __future__ import annotations

from itertools import zip_longest
from typing import Final

from palpate.adapters.log import CallEntry, TickRecord

SLEEP: Final = "clock.sleep_until"
NOW: Final = "clock.now_ns"
FORCE: Final = "force_sensor.read"
JOINTS: Final = "joint_encoder.read"
SEND: Final = "arm.send"
STOP: Final = "arm.stop"
_KNOWN: Final = frozenset({SLEEP, NOW, FORCE, JOINTS, SEND, STOP})


class CallOrder:
    """The two lists; calls are named ``port.call``.

    Attributes:
        made: What the core has called, once it was answered.
    """

    def __init__(self) -> None:
        self.told: list[str] = []
        self.made: list[str] = []

    def tell(self, record: TickRecord) -> None:
        """Add the calls of a tick: a loop makes those that are there in this order."""
        told = self.told
        if record.deadline_ns is not None:
            told.append(SLEEP)
        if record.time_ns is not None:
            told.append(NOW)
        if record.wrench is not None:
            told.append(FORCE)
        if record.joints is not None:
            told.append(JOINTS)
        if record.asked_rad is not None and record.applied is not None:
            told.append(SEND)

    def tell_call(self, call: CallEntry) -> None:
        """Add a call that is none of a tick's own; other entries, such as of an injected fault, are none."""
        name = f"{call.port}.{call.call}"
        if name in _KNOWN:
            self.told.append(name)

    def first_difference(self, *, whole: bool) -> tuple[int, str, str] | None:
        """Where the lists part.

        Args:
            whole: The log goes to the trial's end; else the core may call more than it tells.

        Returns:
            Tick, recorded call and replayed call, where nothing stands for no call; None if they are equal.
        """
        tick = -1
        for told, made in zip_longest(self.told, self.made, fillvalue=""):
            if told == SLEEP:
                tick += 1
            if told != made and (told or whole):
                return tick, told, made
        return None
