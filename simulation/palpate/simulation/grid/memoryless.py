"""The best policy that always takes the same action for a symbol: a ceiling for all that have no memory and no dice."""

from __future__ import annotations

from functools import lru_cache
from itertools import product
from typing import Final

import numpy as np

from palpate.core.errors import ConfigurationError
from palpate.core.perception import IdentityState
from palpate.simulation.grid.chain import ExpectedSteps, expected_steps
from palpate.simulation.grid.maps import COMPASS, GridMap
from palpate.simulation.grid.trial import STEP_LIMIT

MOST_SYMBOLS: Final = 6
"""With a seventh there would be two million policies to try."""


@lru_cache(maxsize=16)
def best_fixed_actions(grid: GridMap, step_limit: int = STEP_LIMIT) -> ExpectedSteps:
    """What the best of all such policies costs, by trying every one of them.

    Args:
        grid: The map.
        step_limit: Steps after which a trial is cut off; the best policy is the one with the fewest steps so.

    Raises:
        ConfigurationError: The map has too many symbols.
    """
    count = len(grid.symbols)
    if count > MOST_SYMBOLS:
        raise ConfigurationError("grid.map", f"{count} symbols", f"at most {MOST_SYMBOLS}, to try all policies")
    policies = np.array(list(product(range(len(COMPASS)), repeat=count)), dtype=np.int8)
    goal = len(grid.cells)
    targets = [[goal if target is None else target for target in row] for row in grid.moves]
    moves, readings = np.array(targets, dtype=np.int16), np.array(grid.readings)
    total = np.zeros(len(policies), dtype=np.int64)
    for start in range(goal):
        running, cells = np.arange(len(policies)), np.full(len(policies), start, dtype=np.int16)
        # Who has not arrived after as many steps as there are cells goes round in circles.
        for _ in range(min(step_limit, goal)):
            total[running] += 1
            cells = moves[cells, policies[running, readings[cells]]]
            running, cells = running[cells != goal], cells[cells != goal]
        total[running] += max(0, step_limit - goal)
    best = policies[int(np.argmin(total))]
    policy = [[float(index == action) for index in range(len(COMPASS))] for action in best]
    return expected_steps(grid, IdentityState(grid.symbols), policy, step_limit)
