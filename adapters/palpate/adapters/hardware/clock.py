"""Clock for runs on a real arm: the computer's monotonic clock, with time 0 at the start of each run."""

import time
from collections.abc import Callable

from typing_extensions import override

from palpate.core.ports import Clock


class MonotonicClock(Clock):
    """Real-time clock that sleeps until absolute deadlines, so that delays do not accumulate.

    Args:
        origin_ns: Monotonic system time at which this clock reads 0, or None for the current time.
        real_time_factor: Clock seconds per real second; below 1 to match slow emulated devices.
    """

    def __init__(self, origin_ns: int | None = None, real_time_factor: float = 1.0) -> None:
        self._origin_ns = time.monotonic_ns() if origin_ns is None else origin_ns
        self.real_time_factor = real_time_factor

    @override
    def now_ns(self) -> int:
        return round((time.monotonic_ns() - self._origin_ns) * self.real_time_factor)

    def sleep_until(self, deadline_ns: int) -> None:
        """Sleep until a deadline; return immediately if it has passed."""
        while (left_ns := deadline_ns - self.now_ns()) > 0:
            time.sleep(left_ns * 1e-9 / self.real_time_factor)


def sleeping(clock: Clock) -> Callable[[float], None]:
    """Return a function that sleeps for a given number of seconds on a clock, as drivers require."""

    def sleep(seconds: float) -> None:
        clock.sleep_until(clock.now_ns() + round(seconds * 1e9))

    return sleep
