"""Ctrl-C and the other signals that end a process, while a command runs."""

from __future__ import annotations

import signal
import threading
from contextlib import ExitStack
from time import monotonic
from typing import Final

from palpate.adapters.signals import on_ending_signal

QUIET_S: Final = 5.0
"""Time for a command to close what it has open; who presses Ctrl-C again meanwhile wants no more than that."""


class Interrupts:
    """While inside, the signals that end a process raise KeyboardInterrupt.

    SIGINT and SIGTERM do so also where a shell lets them be ignored. Another signal within ``QUIET_S`` does nothing: it
    would interrupt the closing of logs and devices. Later ones raise again, for a command that still has not ended.

    Args:
        last: The process ends with the command: SIGINT is ignored from then on, and does not interrupt its end.

    Attributes:
        raised: Whether there was one.
    """

    def __init__(self, *, last: bool = False) -> None:
        self.raised = False
        self._last, self._raised_s = last, 0.0
        self._handled = ExitStack()

    def __enter__(self) -> Interrupts:
        if self._last and threading.current_thread() is threading.main_thread():
            self._handled.callback(signal.signal, signal.SIGINT, signal.SIG_IGN)
        self._handled.enter_context(on_ending_signal(self._raise))
        return self

    def __exit__(self, *_: object) -> None:
        self._handled.close()

    def _raise(self, number: int) -> None:
        now_s = monotonic()
        if self.raised and now_s - self._raised_s < QUIET_S:
            return
        self.raised, self._raised_s = True, now_s
        raise KeyboardInterrupt
