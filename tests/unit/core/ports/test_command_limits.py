"""Commands are kept within velocity and position limits, and it is told why."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.core.ports import CommandLimiter, CommandReason

LOWER, UPPER, SPEED, RATE = (-1.0, -2.0), (1.0, 0.5), (14.0, 1.4), 140.0
PERIOD_NS = 10**9 // 140
ANGLES = st.tuples(st.floats(-3, 3), st.floats(-3, 3))


def limiter(held: tuple[float, float] = (0.0, 0.0)) -> CommandLimiter:
    made = CommandLimiter(LOWER, UPPER, SPEED, RATE)
    made.start(held)
    return made


def test_a_fast_step_is_shortened_in_its_own_direction() -> None:
    applied = limiter().limited((0.05, -0.5), 0)
    assert applied.reason is CommandReason.VELOCITY_LIMIT
    assert applied.position_rad == pytest.approx((0.001, -0.01))


def test_commands_of_one_time_replace_each_other() -> None:
    made = limiter()
    for _ in range(5):
        applied = made.limited((1.0, 0.0), 7)
    assert applied.position_rad == pytest.approx((0.1, 0.0))
    assert made.limited((-1.0, 0.0), 7).position_rad == pytest.approx((-0.1, 0.0))


def test_time_counts_and_not_calls() -> None:
    made = limiter()
    for k in range(200):
        applied = made.limited((1.0, 0.0), k * 35_000)
    # 7 ms at 14 rad/s, and what a period and a quarter of it allow besides.
    assert applied.position_rad[0] <= 14.0 * (0.007 + 1.25 / RATE)


def test_a_command_that_comes_early_after_a_late_one_is_not_held_back() -> None:
    made, reached = limiter((-1.0, 0.0)), -1.0
    for k in range(18):
        reached += 0.0999
        applied = made.limited((reached, 0.0), k * PERIOD_NS + 1_000_000 * (k % 2))
        assert applied.reason is CommandReason.AS_ASKED


@given(st.lists(st.tuples(ANGLES, st.integers(0, 3 * PERIOD_NS)), min_size=1, max_size=20))
def test_no_sequence_of_commands_leaves_the_limits(commands: list[tuple[tuple[float, float], int]]) -> None:
    made, before, now_ns = limiter(), (0.0, 0.0), 0
    for asked, passed_ns in commands:
        now_ns += passed_ns
        applied = made.limited(asked, now_ns)
        for q, old, low, high, speed in zip(applied.position_rad, before, LOWER, UPPER, SPEED, strict=True):
            assert low <= q <= high
            # Twice: a newer command of the same time goes from one side to the other.
            assert abs(q - old) <= speed / RATE * (2.0 if passed_ns == 0 else 1.0) * (1 + 1e-9) + 1e-12
            assert abs(q) <= speed * (now_ns * 1e-9 + 1.25 / RATE + 2e-6) + 1e-12
        assert (applied.reason is CommandReason.AS_ASKED) == (applied.position_rad == asked)
        before = applied.position_rad
