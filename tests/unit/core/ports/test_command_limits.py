"""Commands are kept within velocity and position limits, and it is told why."""

from hypothesis import given
from hypothesis import strategies as st

from palpate.core.ports import AppliedCommand, CommandLimiter, CommandReason

LOWER, UPPER, SPEED, RATE = (-1.0, -2.0), (1.0, 0.5), (14.0, 1.4), 140.0
REACH = (0.1, 0.01)
ANGLES = st.tuples(st.floats(-3, 3), st.floats(-3, 3))


def limiter(held: tuple[float, float] = (0.0, 0.0)) -> CommandLimiter:
    made = CommandLimiter(LOWER, UPPER, SPEED, RATE)
    made.start(held)
    return made


def test_what_is_within_all_limits_passes_unchanged() -> None:
    assert limiter().limited((0.05, -0.005), 0) == AppliedCommand((0.05, -0.005), CommandReason.AS_ASKED)


def test_a_fast_step_is_shortened_joint_by_joint() -> None:
    applied = limiter().limited((0.05, -0.5), 0)
    assert applied == AppliedCommand((0.05, -0.01), CommandReason.VELOCITY_LIMIT)


def test_the_position_limit_has_the_last_word() -> None:
    applied = limiter((0.95, 0.0)).limited((1.02, 0.2), 0)
    assert applied == AppliedCommand((1.0, 0.01), CommandReason.POSITION_LIMIT)


def test_commands_of_one_tick_replace_each_other() -> None:
    made = limiter()
    for _ in range(5):
        applied = made.limited((1.0, 0.0), 7)
    assert applied.position_rad == (0.1, 0.0)
    assert made.limited((1.0, 0.0), 8).position_rad == (0.2, 0.0)


@given(st.lists(ANGLES, min_size=1, max_size=20))
def test_no_sequence_of_commands_leaves_the_limits(commands: list[tuple[float, float]]) -> None:
    made, before = limiter(), (0.0, 0.0)
    for tick, asked in enumerate(commands):
        applied = made.limited(asked, tick)
        for q, old, low, high, reach in zip(applied.position_rad, before, LOWER, UPPER, REACH, strict=True):
            assert low <= q <= high
            assert abs(q - old) <= reach * (1 + 1e-12)
        assert (applied.reason is CommandReason.AS_ASKED) == (applied.position_rad == asked)
        before = applied.position_rad
