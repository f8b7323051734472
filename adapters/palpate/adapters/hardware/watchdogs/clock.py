"""A clock that feeds watchdogs: whoever waits for the next tick is alive."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from typing import Protocol

from palpate.core.ports.devices import Clock


class Fed(Protocol):
    """A watchdog that must be fed each tick."""

    @abstractmethod
    def feed(self) -> None:
        """The loop lives."""


class WatchedClock(Clock):
    """Feeds at the end of each sleep, which is where a tick begins; so a loop over the ports need not know of it.

    Args:
        clock: The clock.
        watchdogs: Are fed.
    """

    def __init__(self, clock: Clock, watchdogs: Sequence[Fed]) -> None:
        self._clock, self._watchdogs = clock, tuple(watchdogs)

    def now_ns(self) -> int:
        """See :class:`Clock`."""
        return self._clock.now_ns()

    def sleep_until(self, deadline_ns: int) -> None:
        """See :class:`Clock`."""
        self._clock.sleep_until(deadline_ns)
        for watchdog in self._watchdogs:
            watchdog.feed()
