"""All port calls of a trial in their order: those of its log, and those that the core makes now."""

from itertools import zip_longest
from typing import Final

from palpate.adapters.log import CallEntry

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
        told: Those of the log.
        made: What the core has called, once it was answered.
    """

    def __init__(self) -> None:
        self.told: list[str] = []
        self.made: list[str] = []

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
