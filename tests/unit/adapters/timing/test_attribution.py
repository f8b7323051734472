"""The lateness of a tick is shared out between our own work and the system."""

from __future__ import annotations

import threading
import time

import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.adapters.timing import Cause, ThreadAccount, attribute

NS = st.integers(0, 10**12)


@pytest.mark.parametrize(
    ("own_ns", "delay_ns", "cause"),
    [
        (0, 0, Cause.WOKEN_LATE),
        (900, 0, Cause.OWN_WORK),
        (0, 900, Cause.NO_CPU),
        # The kernel's account is exact: what it explains, our work does not have to.
        (1000, 900, Cause.NO_CPU),
        (600, 300, Cause.OWN_WORK),
        (100, 300, Cause.WOKEN_LATE),
    ],
)
def test_the_largest_share_is_the_cause(own_ns: int, delay_ns: int, cause: Cause) -> None:
    assert attribute(1000, own_ns, delay_ns).cause is cause


@given(late=NS, own=st.integers(-(10**12), 10**12), delay=st.integers(-(10**12), 10**12))
def test_the_shares_add_up_and_none_is_negative(late: int, own: int, delay: int) -> None:
    a = attribute(late, own, delay)
    assert a.own_ns + a.no_cpu_ns + a.woken_late_ns == late
    assert min(a.own_ns, a.no_cpu_ns, a.woken_late_ns) >= 0


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
    assert after[0] >= before[0] + 1_000_000
    assert after[1] >= before[1]
    mine.close()
    mine.close()
