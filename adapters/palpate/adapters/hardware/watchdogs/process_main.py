"""The process that watches: reads feedings, single bytes, from a pipe, and acts when they stop coming."""

import importlib
import os
import select
import sys
import time
from collections.abc import Callable
from contextlib import suppress
from typing import Final

from palpate.adapters.signals import ignore_ending_signals

FED: Final = b"f"
RESTING: Final = b"r"
ACKNOWLEDGED: Final = b"a"
QUIT: Final = b"q"
READY: Final = b"R"
TRIPPED: Final = b"T"


class Watch:
    """Serves one pipe.

    Args:
        timeout_s: Longest time between feedings, s.
        act: Is called once when they stop coming; told whether whoever feeds is still there.
    """

    def __init__(self, timeout_s: float, act: Callable[[bool], None]) -> None:
        self._timeout_s, self._act = timeout_s, act
        self._deadline_s: float | None = None
        self._tripped = False

    def serve(self, feeding_fd: int) -> None:
        """Until told to quit, or until nobody is left who could."""
        while True:
            left_s = None if self._deadline_s is None else max(self._deadline_s - time.monotonic(), 0.0)
            if not select.select([feeding_fd], [], [], left_s)[0]:
                self._trip(alive=True)
                continue
            words = os.read(feeding_fd, 4096)
            if QUIT in words:
                return
            if not words:
                # It ended without a word: killed, or crashed.
                self._trip(alive=False)
                return
            for word in words:
                self._take(bytes([word]))

    def _take(self, word: bytes) -> None:
        if word == ACKNOWLEDGED:
            self._tripped = False
        if word == FED and not self._tripped:
            self._deadline_s = time.monotonic() + self._timeout_s
        else:
            self._deadline_s = None

    def _trip(self, *, alive: bool) -> None:
        self._deadline_s = None
        if not self._tripped:
            self._tripped = True
            self._act(alive)


def stop_function(name: str) -> Callable[[], object] | None:
    """The function of that name, ``package.module:function``; None for an empty name."""
    if not name:
        return None
    module, _, attribute = name.partition(":")
    found: Callable[[], object] = getattr(importlib.import_module(module), attribute)
    return found


def main() -> None:
    """Watch the parent: arguments are the time limit in s, its process number, a signal for it, and a function."""
    # An end is asked of the run; it ends us by ending our input.
    ignore_ending_signals()
    timeout_s, host, signal_number = float(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3])
    try:
        stop = stop_function(sys.argv[4])
    except (ImportError, AttributeError, ValueError) as error:
        sys.exit(f"watchdog process: {error}")

    def act(alive: bool) -> None:
        # The signal first: it takes no time. Another process may have the number by now, but then it is not our parent.
        if alive and signal_number and os.getppid() == host:
            with suppress(ProcessLookupError):
                os.kill(host, signal_number)
        if stop is not None:
            with suppress(Exception):
                # Nobody is there to be told, and the report below matters more.
                stop()
        if alive:
            with suppress(OSError):
                os.write(1, TRIPPED)

    os.write(1, READY)
    Watch(timeout_s, act).serve(0)


if __name__ == "__main__":
    main()
