"""The lateness of a tick is shared out between our own work and the system."""

from __future__ import annotations

import threading
import time

import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.adapters.timing import Cause, ThreadAccount, attribute

NS, ANY_NS = st.integers(0, 10**12), st.integers(-(10**12), 10**12)


@pytest.mark.parametrize(
    ("at_work_ns", "delay_ns", "taken_ns", "cause"),
    [
        (0, 0, 0, Cause.WOKEN_LATE),
        (900, 0, 0, Cause.OWN_WORK),
        (0, 900, 0, Cause.NO_CPU),
        # The kernel's accounts are exact: what they explain, our work does not have to.
        (1000, 900, 0, Cause.NO_CPU),
        (600, 300, 0, Cause.OWN_WORK),
        (100, 300, 0, Cause.WOKEN_LATE),
        (900, 0, 600, Cause.TAKEN),
        (900, 0, 300, Cause.OWN_WORK),
        # A processor can be taken away only from who is at work.
        (0, 0, 600, Cause.WOKEN_LATE),
    ],
)
def test_the_largest_share_is_the_cause(at_work_ns: int, delay_ns: int, taken_ns: int, cause: Cause) -> None:
    assert attribute(1000, at_work_ns, delay_ns, taken_ns).cause is cause


@given(late=NS, at_work=ANY_NS, delay=ANY_NS, taken=ANY_NS)
def test_the_shares_add_up_and_none_is_negative(late: int, at_work: int, delay: int, taken: int) -> None:
    a = attribute(late, at_work, delay, taken)
    assert a.own_ns + a.no_cpu_ns + a.taken_ns + a.woken_late_ns == late
    assert min(a.own_ns, a.no_cpu_ns, a.taken_ns, a.woken_late_ns) >= 0


def account() -> ThreadAccount:
    made = ThreadAccount.if_kept()
    if made is None:
        pytest.skip("this system keeps no accounts of threads")
    return made


def test_the_account_is_of_this_thread_and_only_grows() -> None:
    mine = account()
    before = mine.read()
    worker = threading.Thread(target=lambda: sum(range(300_000)))
    worker.start()
    worker.join()
    until = time.thread_time_ns() + 1_000_000
    while time.thread_time_ns() < until:
        pass
    after = mine.read()
    assert after.run_ns >= before.run_ns + 1_000_000
    assert after.delay_ns >= before.delay_ns
    assert after.turns >= before.turns
    mine.close()
    mine.close()


def test_a_thread_that_waits_is_given_a_processor_anew() -> None:
    mine = account()
    before = mine.read()
    for _ in range(5):
        time.sleep(0.001)
    assert mine.read().turns >= before.turns + 5
    mine.close()
