"""A signal that stops: its handler acts at once, and a pipe wakes a thread even while the main thread is stuck."""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Callable
from contextlib import suppress
from types import FrameType
from typing import Any

from palpate.core.errors import ConfigurationError, LifecycleError


class StopSignal:
    """Handles one signal.

    The interpreter runs handlers in the main thread only, and not before the main thread is back from whatever it does
    in C. So the signal's number is written to a pipe as well, at the very moment, for a thread to read; unless somebody
    else, such as an event loop, uses that way already.

    Args:
        number: The signal.
        pipe_fd: End of the pipe to write to, not blocking.
        act: Is called by the handler, in the main thread; must take no lock.
    """

    def __init__(self, number: int, pipe_fd: int, act: Callable[[], None]) -> None:
        self._number, self._pipe_fd, self._act = number, pipe_fd, act
        self._before: Any = None
        self._open = self._wakes = False

    def open(self) -> None:
        """Install the handler.

        Raises:
            ConfigurationError: There is no such signal, it cannot be handled, or this is not the main thread.
        """
        try:
            self._before = signal.signal(self._number, self._handle)
        except (ValueError, OSError) as error:
            accepted = f"a signal that can be handled, set up in the main thread ({error})"
            raise ConfigurationError("operator_stop.signal", self._number, accepted) from error
        self._open = True
        theirs = signal.set_wakeup_fd(self._pipe_fd, warn_on_full_buffer=False)
        self._wakes = theirs == -1
        if not self._wakes:
            signal.set_wakeup_fd(theirs)

    def close(self) -> None:
        """Put back what was there before; allowed twice.

        Raises:
            LifecycleError: This is not the main thread, which alone may do that.
        """
        if not self._open:
            return
        if threading.current_thread() is not threading.main_thread():
            raise LifecycleError("operator stop", "open", "close()", "call it in the main thread, as open()")
        self._open = False
        if self._wakes:
            signal.set_wakeup_fd(-1)
        # None: somebody's handler that is not Python's, which nobody could put back.
        signal.signal(self._number, signal.SIG_DFL if self._before is None else self._before)

    def _handle(self, number: int, frame: FrameType | None) -> None:
        self._act()
        if not self._wakes:
            with suppress(BlockingIOError):
                # A full pipe wakes as well.
                os.write(self._pipe_fd, bytes([self._number]))
