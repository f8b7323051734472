"""The light push that is answered between walls, on walls of the test's own."""

from collections import deque
from dataclasses import dataclass
from math import hypot
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.core.ports.values import PERIOD_S, Vector3
from palpate.core.tasks.contact.wall_check import ANSWER_N, WallCheck

LATERAL_N_PER_M = 4e4
PLAY_M = 0.6e-3


@dataclass
class Course:
    """What came of a push."""

    check: WallCheck
    peak_N: float
    gone_m: tuple[float, float]


def push(
    *,
    gap_m: float = 0.1e-3,
    at_m: tuple[float, float] = (0.0, 0.0),
    lag_ticks: float = 0.0,
    repeats: int = 1,
    noise_N: float = 0.0,
    scale: float = 1.0,
    rotated: bool = False,
) -> Course:
    """Push a peg that stands beside the middle of a round hole with this gap to every side."""
    check = WallCheck(PLAY_M)
    check.begin((*at_m, 0.0))
    rng, seen = np.random.default_rng(5), deque[Vector3](maxlen=1)
    (x, y), (px, py) = at_m, at_m
    peak_N = 0.0
    for tick in range(400):
        px, py = px + (x - px) / (1.0 + lag_ticks), py + (y - py) / (1.0 + lag_ticks)
        off = hypot(px, py)
        force = LATERAL_N_PER_M * max(off - gap_m, 0.0)
        fx, fy = (-force * px / off, -force * py / off) if off > 0.0 else (0.0, 0.0)
        peak_N = max(peak_N, force)
        new = tick % repeats == 0
        if new:
            shown = (fy, -fx) if rotated else (fx, fy)
            nx, ny = noise_N * rng.standard_normal(2)
            seen.append((scale * shown[0] + nx, scale * shown[1] + ny, 0.0))
        vx, vy = check.velocity_m_s(seen[0], new, (x, y, 0.0))
        if check.answered or check.failed:
            break
        x, y = x + vx * PERIOD_S, y + vy * PERIOD_S
    return Course(check, peak_N, (x - at_m[0], y - at_m[1]))


@pytest.mark.parametrize(
    ("how", "most_N"),
    [
        ({}, 3.0),
        ({"lag_ticks": 2.0}, 3.0),
        ({"lag_ticks": 2.0, "repeats": 2}, 3.0),
        ({"noise_N": 0.1}, 4.0),
        ({"noise_N": 0.3}, 4.0),
    ],
)
def test_a_wall_answers_a_push_of_a_few_newtons(how: dict[str, Any], most_N: float) -> None:
    course = push(**how)
    assert course.check.answered
    assert how or course.check.answer_N >= ANSWER_N
    assert course.peak_N < most_N


def test_no_wall_within_the_play_is_a_failure() -> None:
    course = push(gap_m=1.0)
    assert course.check.failed
    assert not course.check.answered
    assert hypot(*course.gone_m) == pytest.approx(PLAY_M + 1e-4, abs=2e-5)


@pytest.mark.parametrize("noise_N", [0.1, 0.3])
def test_noise_alone_is_no_answer(noise_N: float) -> None:
    assert push(gap_m=1.0, noise_N=noise_N).check.failed


@pytest.mark.parametrize("scale", [0.0, 0.01, -1.0])
def test_a_sensor_that_is_dead_scaled_down_or_flipped_gives_no_answer(scale: float) -> None:
    course = push(scale=scale)
    assert course.check.failed
    assert course.peak_N < LATERAL_N_PER_M * (PLAY_M + 1e-4)


@given(st.floats(0.5, 4.0))
def test_the_answer_grows_with_the_sensors_scale(scale: float) -> None:
    course = push(scale=scale)
    assert course.check.answered
    assert course.check.answer_N == pytest.approx(ANSWER_N, rel=0.5 * max(scale, 1.0))


def test_a_tip_as_far_out_as_a_wall_can_be_goes_no_further_out() -> None:
    check = WallCheck(PLAY_M)
    check.begin((1e-3, 0.0, 0.0))
    outside, inside = (1e-3 + PLAY_M + 2e-4, 0.0, 0.0), (1e-3 + PLAY_M, 0.0, 0.0)
    outwards, inwards = (0.005, 0.001, 0.01), (-0.005, 0.001, 0.01)
    assert check.bounded(outwards, inside) == outwards
    assert check.bounded(inwards, outside) == inwards
    assert check.bounded(outwards, outside) == (0.0, 0.0, 0.01)
