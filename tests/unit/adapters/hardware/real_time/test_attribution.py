"""The lateness of a tick is shared out between our own work and the system."""

import threading
import time

import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.adapters.hardware.real_time import Cause, ThreadAccount, attribute


@pytest.mark.parametrize(
    ("delay_ns", "taken_ns", "own_ns", "cause"),
    [
        (0, 0, 0, Cause.WOKEN_LATE),
        (0, 0, 900, Cause.OWN_WORK),
        (900, 0, 0, Cause.NO_CPU),
        # What is claimed first, later ones do not have to explain.
        (900, 0, 1000, Cause.NO_CPU),
        (300, 0, 600, Cause.OWN_WORK),
        (300, 0, 100, Cause.WOKEN_LATE),
        (0, 600, 900, Cause.TAKEN),
        (0, 300, 900, Cause.OWN_WORK),
    ],
)
def test_the_largest_share_is_the_cause(delay_ns: int, taken_ns: int, own_ns: int, cause: Cause) -> None:
    claims = [(Cause.NO_CPU, delay_ns), (Cause.TAKEN, taken_ns), (Cause.OWN_WORK, own_ns)]
    assert attribute(1000, claims).cause is cause


@given(late=st.integers(0, 10**12), claims=st.lists(st.tuples(st.sampled_from(Cause), st.integers(-(10**12), 10**12))))
def test_the_shares_add_up_and_none_is_negative(late: int, claims: list[tuple[Cause, int]]) -> None:
    shares = attribute(late, claims).shares_ns
    assert sum(shares.values()) == late
    assert min(shares.values()) >= 0


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
