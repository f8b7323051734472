"""Pushes to and fro between two walls, and what only seems to answer them."""

from collections.abc import Callable
from itertools import product
from typing import Any

import numpy as np
import pytest

from palpate.core.ports.values import PERIOD_S
from palpate.core.tasks.contact import BothWallsCheck
from palpate.core.tasks.contact.both_walls import FOLLOWED_N

LATERAL_N_PER_M = 4e4
PLAY_M = 0.6e-3
Sensor = Callable[[float, int, np.random.Generator], float]


def push(
    shown_N: Sensor,
    *,
    gap_m: float = 0.1e-3,
    repeats: int = 1,
    seed: int = 5,
    lag_ticks: float = 0.0,
    begun_m: tuple[float, float] = (0.0, 0.0),
) -> tuple[BothWallsCheck, float]:
    """Pushes along x between walls at this distance from the middle; returns the check and the highest true force."""
    check, rng = BothWallsCheck(PLAY_M), np.random.default_rng(seed)
    check.begin((*begun_m, 0.0))
    x, y, tip_x, tip_y, seen, peak_N = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for tick in range(2000):
        tip_x, tip_y = tip_x + (x - tip_x) / (1.0 + lag_ticks), tip_y + (y - tip_y) / (1.0 + lag_ticks)
        true_N = -LATERAL_N_PER_M * np.sign(tip_x) * max(abs(tip_x) - gap_m, 0.0)
        peak_N = max(peak_N, abs(true_N))
        new = tick % repeats == 0
        if new:
            seen = shown_N(true_N, tick, rng)
        vx, vy = check.velocity_m_s((seen, 0.0, 0.0), new, (x, y, 0.0), (tip_x, tip_y, 0.0))
        if check.answered or check.failed:
            break
        x, y = x + vx * PERIOD_S, y + vy * PERIOD_S
    assert check.answered != check.failed
    return check, peak_N


@pytest.mark.parametrize("gap_m", [2e-5, 7.5e-5, 2.5e-4])
@pytest.mark.parametrize("noise_N", [0.0, 0.1, 0.3])
def test_walls_are_felt_on_both_sides(gap_m: float, noise_N: float) -> None:
    check, peak_N = push(lambda true_N, _, rng: true_N + noise_N * rng.standard_normal(), gap_m=gap_m)
    assert check.answered
    first_N, other_N, *_ = check.forces_N
    assert other_N - first_N >= FOLLOWED_N
    assert peak_N < 9.0


@pytest.mark.parametrize("late", [{"repeats": 3}, {"lag_ticks": 3.0}, {"lag_ticks": 6.0}, {"lag_ticks": 12.0}])
def test_a_slow_sensor_and_an_arm_that_is_still_under_way_are_waited_for(late: dict[str, Any]) -> None:
    assert push(lambda true_N, _, rng: true_N + 0.1 * rng.standard_normal(), **late)[0].answered


@pytest.mark.parametrize(("begun_mm", "most_N"), [(-0.69, 2.0), (0.5, 12.0)])
def test_pushes_have_one_reach_from_where_the_first_of_the_trial_began(begun_mm: float, most_N: float) -> None:
    """The peg is stuck, and a swing of the force seems to be a wall; 9 and 23 N with a reach from where it stands."""
    check, peak_N = push(lambda _, tick, __: 2.0 if tick < 20 else 0.5, gap_m=0.0, begun_m=(begun_mm * 1e-3, 0.0))
    assert check.failed
    assert peak_N < most_N


@pytest.mark.parametrize(("share", "gap_m"), [(0.0, 1e-4), (0.01, 1e-4), (-1.0, 1e-4), (1.0, 1e-3)])
def test_what_shows_too_little_or_the_wrong_way_fails_and_so_does_a_hole_wider_than_its_play(
    share: float, gap_m: float
) -> None:
    assert push(lambda true_N, _, rng: share * true_N + 0.1 * rng.standard_normal(), gap_m=gap_m)[0].failed


def test_noise_is_no_wall() -> None:
    for seed in range(40):
        assert push(lambda _, __, rng: 0.9 * rng.standard_normal(), seed=seed)[0].failed, seed


@pytest.mark.parametrize("period", [7, 14, 20, 28, 40, 56, 67, 80, 100, 140, 200])
def test_a_recording_that_swings_is_no_wall(period: int) -> None:
    for size_N, at in product((1.0, 2.0, 4.0), range(8)):
        phase = at / 8
        check, _ = push(lambda _, tick, __, n=size_N, p=phase: n * np.sin(2 * np.pi * (tick / period + p)))
        assert check.failed, (size_N, at)
