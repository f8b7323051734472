"""The real clock keeps the contract of the port, and drifts from nothing."""

from __future__ import annotations

import time

from palpate.adapters.hardware.clock import MonotonicClock
from palpate.core.ports.contracts import ClockContract, ClockRig


class TestMonotonicClock(ClockContract):
    def make(self) -> ClockRig:
        # An ordinary kernel on a busy machine wakes a sleeper late; it never wakes it early.
        return ClockRig(clock=MonotonicClock(), tolerance_ns=1_000_000_000, step_ns=20_000_000)


def test_time_is_the_system_s_own() -> None:
    clock = MonotonicClock()
    before = time.monotonic_ns()
    now = clock.now_ns() + clock.origin_ns
    assert before <= now <= time.monotonic_ns()


def test_a_deadline_that_is_past_is_no_sleep() -> None:
    clock = MonotonicClock()
    clock.sleep_until(-(10**15))
    assert clock.now_ns() < 10**10
