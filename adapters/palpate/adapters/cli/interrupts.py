"""Ctrl-C and SIGTERM while a command runs."""

from __future__ import annotations

import signal
import threading
from time import monotonic
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from types import FrameType

QUIET_S: Final = 5.0
"""Time for a command to close what it has open; who presses Ctrl-C again meanwhile wants no more than that."""


class Interrupts:
    """While inside, SIGINT and SIGTERM raise KeyboardInterrupt, also where a shell lets them be ignored.

    Another one within ``QUIET_S`` does nothing: it would interrupt the closing of logs and devices. Later ones raise
    again, for a command that still has not ended.

    Args:
        last: The process ends with the command: SIGINT is ignored from then on, and does not interrupt its end.

    Attributes:
        raised: Whether there was one.
    """

    def __init__(self, *, last: bool = False) -> None:
        self.raised = False
        self._last, self._raised_s = last, 0.0
        # Python leaves signals to its main thread.
        self._heard = threading.current_thread() is threading.main_thread()

    def __enter__(self) -> Interrupts:
        if self._heard:
            self._before = {number: signal.signal(number, self._raise) for number in (signal.SIGINT, signal.SIGTERM)}
        return self

    def __exit__(self, *_: object) -> None:
        if self._heard:
            for number, handler in self._before.items():
                signal.signal(number, signal.SIG_IGN if self._last and number == signal.SIGINT else handler)

    def _raise(self, number: int, frame: FrameType | None) -> None:
        now_s = monotonic()
        if self.raised and now_s - self._raised_s < QUIET_S:
            return
        self.raised, self._raised_s = True, now_s
        raise KeyboardInterrupt
