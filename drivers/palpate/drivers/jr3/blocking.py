"""Helpers that wait, for whoever has nothing else to do: they poll with a clock and a sleep that they are given."""

from collections.abc import Callable, Collection
from typing import Final

from palpate.drivers.errors import SilentError
from palpate.drivers.jr3.device import Jr3
from palpate.drivers.jr3.phases import Jr3Phase

_INTERVAL_S: Final = 0.002


def start_up(device: Jr3, clock_ns: Callable[[], int], sleep: Callable[[float], None], timeout_s: float = 30.0) -> None:
    """Open a sensor and wait until it streams.

    Args:
        device: Closed, silent or faulted.
        timeout_s: Longest wait, in s.

    Raises:
        DriverError: It does not stream; which one says why.
    """
    device.open()
    _wait(device, clock_ns, sleep, {Jr3Phase.STREAMING}, timeout_s)


def shut_down(
    device: Jr3, clock_ns: Callable[[], int], sleep: Callable[[float], None], timeout_s: float = 10.0
) -> None:
    """Stop the stream and wait until the board has taken that, or has not answered; does nothing when closed."""
    if device.phase is not Jr3Phase.CLOSED:
        device.stop()
        _wait(device, clock_ns, sleep, {Jr3Phase.CLOSED, Jr3Phase.FAULTED}, timeout_s)


def _wait(
    device: Jr3,
    clock_ns: Callable[[], int],
    sleep: Callable[[float], None],
    goals: Collection[Jr3Phase],
    timeout_s: float,
) -> None:
    deadline_ns = clock_ns() + round(timeout_s * 1e9)
    while True:
        now_ns = clock_ns()
        device.poll(now_ns)
        if device.phase in goals:
            return
        device.check()
        if now_ns >= deadline_ns:
            problem = f"still {device.phase.value} after {timeout_s:g} s"
            raise SilentError("JR3", problem, "check cable and power, or wait longer")
        sleep(_INTERVAL_S)
