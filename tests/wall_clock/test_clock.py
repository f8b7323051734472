"""The real clock keeps the contract of the port, and drifts from nothing."""

import time

import pytest

from palpate.adapters.contracts import ClockContract, ClockRig, ContractViolation
from palpate.adapters.hardware.clock import MonotonicClock
from tests.wall_clock.late import late_if


class Kept(ClockContract):
    """Its clauses; not collected by itself."""

    def make(self):
        return ClockRig(clock=MonotonicClock(), tolerance_ns=15_000_000, step_ns=20_000_000, deadlines=10)


@pytest.mark.parametrize("clause", [name for name in dir(Kept) if name.startswith("test_")])
def test_it_keeps_the_contract(clause):
    # An ordinary kernel on a busy machine wakes a sleeper late; it never wakes it early.
    with late_if("^(past deadline|drift)", ContractViolation):
        getattr(Kept(), clause)()


def test_time_is_the_system_s_own():
    before = time.monotonic_ns()
    now = MonotonicClock(0).now_ns()
    assert before <= now <= time.monotonic_ns()


def test_clock_of_an_emulated_rig_goes_at_its_real_time_factor(monkeypatch):
    slept = []
    now_ns = [4_000]
    monkeypatch.setattr(time, "monotonic_ns", lambda: now_ns[0])
    monkeypatch.setattr(time, "sleep", lambda seconds: (slept.append(seconds), now_ns.append(now_ns.pop() + 4_000)))
    clock = MonotonicClock(0, 0.25)
    assert clock.now_ns() == 1_000
    clock.sleep_until(2_000)
    assert slept == [pytest.approx(4e-6)]
    assert clock.now_ns() == 2_000
