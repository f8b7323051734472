"""The run's time on a real arm: the computer's monotonic clock, counted from the run's start."""

import time
from collections.abc import Callable

from typing_extensions import override

from palpate.core.ports import Clock


class MonotonicClock(Clock):
    """Real time. Sleeps to absolute deadlines, so that lateness never adds up.

    Args:
        origin_ns: The system's monotonic clock at the time 0 of this one; None begins now.
        real_time_factor: Seconds of this clock in a second; below 1 with emulated devices whose clock is as slow.
    """

    def __init__(self, origin_ns: int | None = None, real_time_factor: float = 1.0) -> None:
        self._origin_ns = time.monotonic_ns() if origin_ns is None else origin_ns
        self.real_time_factor = real_time_factor

    @override
    def now_ns(self) -> int:
        return round((time.monotonic_ns() - self._origin_ns) * self.real_time_factor)

    def sleep_until(self, deadline_ns: int) -> None:
        """Sleep to a deadline; one that is past returns at once."""
        while (left_ns := deadline_ns - self.now_ns()) > 0:
            time.sleep(left_ns * 1e-9 / self.real_time_factor)


def sleeping(clock: Clock) -> Callable[[float], None]:
    """A function that waits so many seconds on a clock; drivers take one."""

    def sleep(seconds: float) -> None:
        clock.sleep_until(clock.now_ns() + round(seconds * 1e9))

    return sleep
