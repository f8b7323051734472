"""A thread that notices when something has not happened for too long."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Final

from palpate.core.errors import ConfigurationError, LifecycleError
from palpate.core.ports.devices import Clock

_JOIN_S: Final = 5.0
_NS: Final = 1_000_000_000


class AgeWatch:
    """Calls when the last feeding is too old: at most a tenth of the limit too late.

    The thread sleeps as long as nothing can be too old, and without end while resting. The first feeding starts it.

    Args:
        name: Name of the thread.
        clock: Tells the age. While a virtual clock stands still nothing ages.
        max_age_ns: Oldest feeding that is not too old.
        on_old: Is called with the age in ns, by the thread or by whoever calls ``check``, or by both at once; then the
            watch rests until it is fed again.

    Raises:
        ConfigurationError: The limit is not positive.
    """

    def __init__(self, name: str, clock: Clock, max_age_ns: int, on_old: Callable[[int], None]) -> None:
        if max_age_ns <= 0:
            raise ConfigurationError(f"{name}, max_age_ns", max_age_ns, "more than 0")
        self._name, self._clock, self._max_age_ns, self._on_old = name, clock, max_age_ns, on_old
        self._slack_s = max(0.1 * max_age_ns / _NS, 1e-3)
        self._wake = threading.Event()
        self._thread: threading.Thread | None = None
        self._fed_ns = 0
        self._watching = self._ended = False

    def feed(self) -> None:
        """It has happened; from now on it has to happen again and again.

        Raises:
            LifecycleError: The watch has ended.
        """
        self._fed_ns = self._clock.now_ns()
        if not self._watching:
            self._begin()

    def rest(self) -> None:
        """It need not happen until the next feeding. May be called by a signal handler."""
        self._watching = False

    def check(self) -> bool:
        """Look now; True if it was too old."""
        age_ns = self._clock.now_ns() - self._fed_ns
        if not self._watching or age_ns <= self._max_age_ns:
            return False
        # In this order: nobody who looks now may find it well before what must be done is done.
        self._on_old(age_ns)
        self._watching = False
        return True

    def end(self) -> None:
        """End the thread; allowed twice."""
        self._ended, self._watching = True, False
        self._wake.set()
        thread = self._thread
        if thread is not None and thread is not threading.current_thread():
            thread.join(_JOIN_S)

    def _begin(self) -> None:
        if self._ended:
            raise LifecycleError(self._name, "closed", "feed()", "make a new one")
        self._watching = True
        if self._thread is None:
            self._thread = threading.Thread(target=self._run, name=self._name, daemon=True)
            self._thread.start()
        self._wake.set()

    def _run(self) -> None:
        while not self._ended:
            # Cleared first: what is set from here on ends the wait below.
            self._wake.clear()
            self.check()
            timeout_s = None
            if self._watching:
                left_ns = self._max_age_ns - (self._clock.now_ns() - self._fed_ns)
                timeout_s = max(left_ns / _NS, 0.0) + self._slack_s
            if not self._ended:
                self._wake.wait(timeout_s)
