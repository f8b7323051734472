"""Profiles against closed forms."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.simulation.emulators.nmc.motion import CAPACITY, ONE_COUNT, PathBuffer, Profile

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


def test_velocity_profile_ramps_and_holds() -> None:
    profile = Profile()
    profile.start_velocity(-1_000_000, 1_000)
    assert run(profile) == 1_000
    assert profile.accelerated
    start = profile.position
    for _ in range(10):
        profile.tick()
    assert profile.position - start == -10_000_000
    profile.stop_smoothly()
    assert not profile.done
    assert run(profile) == 1_000
    assert profile.velocity == 0


def test_without_acceleration_nothing_moves() -> None:
    profile = Profile()
    profile.start_trapezoid(1_000, 1 << 20, 0)
    assert run(profile, 100) == 100
    assert profile.counts == 0


@pytest.mark.parametrize(
    ("word", "fast", "ticks", "counts"),
    [
        (100 * 4 | 2, False, 64, 100),  # 30 Hz
        (100 * 8, False, 32, 100),  # 60 Hz
        (100 * 8 | 2, True, 32, 100),  # 60 Hz of the fast pair
        (100 * 16 | 1, True, 16, -100),  # 120 Hz, backwards
    ],
)
def test_path_points_cover_their_distance(word: int, fast: bool, ticks: int, counts: int) -> None:
    path = PathBuffer()
    path.add((word,))
    path.start()
    total = taken = 0
    while (velocity := path.next_velocity(fast=fast)) is not None:
        total, taken = total + velocity, taken + 1
    assert (total, taken) == (counts * ONE_COUNT, ticks)
    assert not path.active


def test_the_path_buffer_has_an_end() -> None:
    path = PathBuffer()
    path.start()
    assert not path.active
    path.add(tuple(range(CAPACITY + 5)))
    assert len(path) == CAPACITY
