import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.simulation.emulators.nmc.motion import ONE_COUNT, Profile

TICK_s = 512e-6
VELOCITY_WORD_PER_COUNT_PER_s = 33.554432
ACCELERATION_WORD_PER_COUNT_PER_s2 = 0.017179869


def run(profile: Profile, limit: int = 1_000_000) -> int:
    ticks = 0
    while not profile.done and ticks < limit:
        profile.tick()
        ticks += 1
    return ticks


@pytest.mark.parametrize("counts", [30_558, -192_000, 5_000])
@pytest.mark.parametrize(("velocity", "acceleration"), [(30_557.75, 100_000.0), (8_000.0, 40_000.0)])
def test_a_trapezoid_takes_the_time_of_its_closed_form(counts: int, velocity: float, acceleration: float) -> None:
    profile = Profile()
    profile.start_trapezoid(
        counts,
        round(velocity * VELOCITY_WORD_PER_COUNT_PER_s),
        round(acceleration * ACCELERATION_WORD_PER_COUNT_PER_s2),
    )
    took_s = run(profile) * TICK_s
    distance = abs(counts)
    ramps = velocity**2 / acceleration
    expected_s = (
        distance / velocity + velocity / acceleration if distance > ramps else 2 * (distance / acceleration) ** 0.5
    )
    assert took_s == pytest.approx(expected_s, rel=2e-3, abs=4 * TICK_s)
    assert profile.position == counts * ONE_COUNT


@settings(max_examples=60, deadline=None)
@given(
    target=st.integers(-3_000, 3_000),
    velocity=st.integers(1 << 14, 1 << 21),
    acceleration=st.integers(100, 1 << 18),
    change=st.integers(0, 400),
    second=st.integers(-3_000, 3_000),
)
def test_a_trapezoid_ends_on_its_target_within_its_limits(
    target: int, velocity: int, acceleration: int, change: int, second: int
) -> None:
    profile = Profile()
    profile.start_trapezoid(target, velocity, acceleration)
    before = 0
    for tick in range(200_000):
        if tick == change:
            profile.start_trapezoid(second, velocity, acceleration)
        profile.tick()
        assert abs(profile.velocity) <= velocity
        assert abs(profile.velocity - before) <= acceleration
        before = profile.velocity
        if profile.done and tick > change:
            break
    assert profile.position == second * ONE_COUNT
    profile.tick()
    assert profile.position == second * ONE_COUNT
