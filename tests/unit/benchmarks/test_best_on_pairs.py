"""The best policy on the last two readings: what it costs on maps where that can be worked out by hand."""

import numpy as np
import pytest

from benchmarks.best_on_pairs import World
from palpate.simulation.grid import GridMap


@pytest.mark.parametrize(
    ("rows", "slips", "misreads", "steps"),
    [
        ("A·", 0.1, 0.0, 1.0 / 0.9),
        ("A·B", 0.0, 0.4, 1.2),  # a fifth reads the other symbol, runs into the wall and can tell by that
        ("AAA·AA", 0.0, 0.0, 41.2),  # a wall reads as a move does: three arrive, two run against it to the limit
    ],
)
def test_the_best_policy_found_costs_what_it_has_to(rows: str, slips: float, misreads: float, steps: float) -> None:
    world = World(GridMap.from_text(rows), slips, misreads)
    assert world.best(np.random.default_rng(0)) == pytest.approx(steps, abs=1e-6)
