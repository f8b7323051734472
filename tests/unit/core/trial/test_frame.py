"""The task frame, random offsets in it, and the square that may be explored."""

from math import hypot, pi

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.core.trial import ExplorationArea, GoalConfig, TaskConfig, draw_in_disc, goal_in_base, reachable_share

SHAPES = ("disc", "ball")


def test_the_task_frame_stands_on_the_plate_and_looks_into_the_hole() -> None:
    goal = goal_in_base(GoalConfig(380.0, -50.0, 25.0))
    assert goal.translation.tolist() == pytest.approx([0.380, -0.050, 0.025])
    for in_task, in_base in (([1, 0, 0], [1, 0, 0]), ([0, 1, 0], [0, -1, 0]), ([0, 0, 1], [0, 0, -1])):
        assert (goal.rotation @ in_task).tolist() == in_base
    assert np.linalg.det(goal.rotation) == pytest.approx(1.0)


@given(st.integers(0, 2**32), st.floats(0.0, 0.05), st.sampled_from(SHAPES))
def test_an_offset_stays_within_its_radius(seed: int, radius: float, shape: str) -> None:
    x, y = draw_in_disc(np.random.default_rng(seed), radius, shape)
    assert hypot(x, y) <= radius * (1 + 1e-12)


@pytest.mark.parametrize(
    ("shape", "mean_square", "numbers"),
    # Mean of (r / R)^2: 1/2 over a disc; 3/5 in a ball, of which two thirds are in the plane.
    [("disc", 0.5, 2), ("ball", 0.4, 3)],
)
def test_offsets_are_spread_evenly(shape: str, mean_square: float, numbers: int) -> None:
    rng, count = np.random.default_rng(11), 20_000
    points = np.array([draw_in_disc(rng, 3e-3, shape) for _ in range(count)])
    radius = np.hypot(*points.T) / 3e-3
    assert (radius**2).mean() == pytest.approx(mean_square, abs=0.01)
    assert radius.max() > 0.99
    sectors = np.histogram(np.arctan2(points[:, 1], points[:, 0]), bins=12, range=(-pi, pi))[0]
    assert ((sectors - count / 12) ** 2 / (count / 12)).sum() < 31.3  # chi squared, 11 degrees, 0.1 %
    # Exactly so many random numbers, or the streams of other purposes would shift.
    other = np.random.default_rng(11)
    other.random(count * numbers)
    assert rng.random() == other.random()


coordinates = st.floats(-0.02, 0.02)


@given(centre=st.tuples(coordinates, coordinates), point=st.tuples(coordinates, coordinates))
def test_clamping_gives_the_nearest_point_of_the_area(centre: tuple[float, float], point: tuple[float, float]) -> None:
    area = ExplorationArea(centre, 3.5e-3)
    clamped = area.clamp(*point)
    for value, c, asked in zip(clamped, centre, point, strict=True):
        assert abs(value - c) <= 3.5e-3 * (1 + 1e-12)
        if abs(asked - c) < 3.5e-3:
            assert value == asked
        elif asked != c:
            assert value == (c + 3.5e-3 if asked > c else c - 3.5e-3)
    assert area.clamp(*clamped) == clamped


@pytest.mark.parametrize(("shape", "share"), [("disc", 0.84), ("ball", 0.92)])
def test_the_papers_literal_area_leaves_holes_outside(shape: str, share: float) -> None:
    literal = TaskConfig(area_half_width_mm=2.5, area_centre="start", start_shape=shape)
    assert reachable_share(literal, hole_uncertainty_mm=0.0) == pytest.approx(share, abs=0.005)


def test_the_share_of_a_small_area_is_that_of_the_areas() -> None:
    small = TaskConfig(area_half_width_mm=1.0, start_uncertainty_mm=1.0)
    assert reachable_share(small, hole_uncertainty_mm=3.0) == pytest.approx(4 / (9 * pi), abs=0.005)
    assert reachable_share(small, 0.0, hole_shift_mm=3.0) == pytest.approx(4 / (9 * pi), abs=0.005)
