"""Maps as the command line names them, and what is possible in each."""

from __future__ import annotations

import os
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from palpate.core.errors import ConfigurationError
from palpate.core.perception import IdentityState
from palpate.simulation.grid.belief import belief_optimum
from palpate.simulation.grid.chain import expected_steps, uniform
from palpate.simulation.grid.maps import SCENARIOS, GridMap
from palpate.simulation.grid.optimum import full_information_optimum
from palpate.simulation.grid.trial import STEP_LIMIT


def grid_named(name: str, size: int) -> GridMap:
    """A map.

    Args:
        name: A scenario (1, 2 or twin), eight regions such as ``ABC/C.E/BDF``, or a text file with rows of letters.
        size: Length of a side in cells, where the map is made of regions; a file has its own.

    Raises:
        ConfigurationError: There is no such map, or it is none.
    """
    if name in SCENARIOS or (name.count("/") == 2 and not os.path.lexists(name)):
        return GridMap.from_regions(SCENARIOS.get(name, name), size)
    try:
        return GridMap.from_text(Path(name).read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        if isinstance(error, ConfigurationError):
            raise
        accepted = f"one of {', '.join(SCENARIOS)}, eight regions such as ABC/C.E/BDF, or a readable text file"
        raise ConfigurationError("map", name, accepted) from error


@dataclass(frozen=True, slots=True)
class Bounds:
    """What is possible in a map: exact mean steps from a uniformly random start.

    Attributes:
        full: With full information: the shortest way.
        belief: The best that anybody can do who knows the map and not the place; None if it takes too long to find.
        random_walk: Of a random walk that is cut off at the limit.
    """

    full: float
    belief: float | None
    random_walk: float


@lru_cache(maxsize=16)
def bounds_of(grid: GridMap, step_limit: int = STEP_LIMIT) -> Bounds:
    """The bounds of a map."""
    try:
        belief = float(belief_optimum(grid))
    except ConfigurationError:
        belief = None
    identity = IdentityState(grid.symbols)
    walk = expected_steps(grid, identity, uniform(len(grid.symbols)), step_limit)
    return Bounds(float(full_information_optimum(grid)), belief, walk.limited_steps)
