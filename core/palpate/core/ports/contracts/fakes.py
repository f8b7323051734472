"""A clock for tests: virtual time, which goes on only by ``advance`` and ``sleep_until``."""

from palpate.core.ports.devices import Clock

TICK_NS = 1_000_000_000 // 140
"""The period of the control loop."""


class FakeClock(Clock):
    """Virtual time: sleeping takes no time at all."""

    def __init__(self, start_ns: int = 0) -> None:
        self._now_ns = start_ns

    def now_ns(self) -> int:
        """Time now."""
        return self._now_ns

    def sleep_until(self, deadline_ns: int) -> None:
        """Put the clock on to the deadline, unless it is past."""
        self._now_ns = max(self._now_ns, deadline_ns)

    def advance(self, ticks: int = 1) -> None:
        """Let so many control ticks go by."""
        self._now_ns += ticks * TICK_NS
