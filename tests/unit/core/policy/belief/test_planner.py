from itertools import pairwise
from math import dist

import numpy as np

from palpate.core.policy.belief.places import SINGLE, Places
from palpate.core.policy.belief.planner import Planner, SpiralSearch


def places(steps: int, radius_m: float = 2e-3) -> np.ndarray:
    search, at, found = SpiralSearch((0.0, 0.0), 3e-4, 8e-4, radius_m), (1e-3, 0.5e-3), []
    for _ in range(steps):
        dx, dy = search.next_m(at)
        at = (at[0] + dx, at[1] + dy)
        found.append(at)
    return np.array(found)


def test_it_begins_at_the_centre_and_covers_the_circle() -> None:
    way = places(90)
    assert dist(way[1], (0.0, 0.0)) < 1e-4
    ways = np.concatenate([np.linspace(a, b, 12) for a, b in pairwise(way)])
    grid = np.array([(x, y) for x in np.linspace(-2e-3, 2e-3, 41) for y in np.linspace(-2e-3, 2e-3, 41)])
    inside = grid[np.hypot(*grid.T) < 1.8e-3]
    gaps = np.array([np.hypot(*(ways - place).T).min() for place in inside])
    assert gaps.max() < 1.8e-4


def test_its_steps_are_of_one_length() -> None:
    steps = np.hypot(*np.diff(places(250, 5e-3)[150:], axis=0).T)
    assert steps.max() <= 8e-4
    assert steps.min() > 0.9 * 8e-4


def test_a_second_pass_lies_between_the_turns_of_the_first() -> None:
    radii = np.hypot(*places(400).T)
    ends = np.flatnonzero(radii > 2e-3)
    assert len(ends) >= 2
    assert radii.max() < 2.4e-3


def test_the_best_way_does_not_depend_on_what_was_foreseen() -> None:
    around = Places(3e-3)
    planner = Planner(around, 3e-4, 8e-4)
    belief = np.random.default_rng(1).random((around.size, around.size)).astype(SINGLE)
    here, there = (1e-3, -5e-4), (-2e-3, 1e-3)
    planner.foresee(here)
    foreseen = planner.best(belief, here, 3e-3)
    assert planner.best(belief, here, 3e-3) == foreseen
    planner.foresee(there)
    assert planner.best(belief, here, 3e-3) == foreseen
