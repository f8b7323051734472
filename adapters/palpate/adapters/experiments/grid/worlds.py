"""Maps and kinds of states as the command line names them, and what is possible in each map."""

import os
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from palpate.adapters.experiments.build import NONE, identifier
from palpate.adapters.files import read_text
from palpate.core.automata import AutomatonState
from palpate.core.errors import ConfigurationError
from palpate.core.perception import StateIdentifier
from palpate.simulation.grid import (
    SCENARIOS,
    STEP_LIMIT,
    GridMap,
    belief_optimum,
    full_information_optimum,
    random_walk_steps,
    walk_strings,
)


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
    accepted = f"one of {', '.join(SCENARIOS)}, eight regions such as ABC/C.E/BDF, or a readable text file"
    return GridMap.from_text(read_text(Path(name), "map", accepted))


@dataclass(frozen=True, slots=True)
class Bounds:
    """What is possible in a map: exact mean steps from a uniformly random start.

    Attributes:
        belief: The optimum with the map known and the place unknown; None if it takes too long to find.
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
    return Bounds(float(full_information_optimum(grid)), belief, random_walk_steps(grid, step_limit))


def states_named(name: str, grid: GridMap) -> StateIdentifier:
    """The states of a map.

    Args:
        name: ``symbols``; ``last-2``, ``last-3`` and so on; or an automaton file.

    Raises:
        ConfigurationError: There are no such states, more than can be learned, or the file is no automaton over symbols
            of the map.
    """
    try:
        return identifier(NONE if name == "symbols" else name, grid.symbols)
    except ConfigurationError as error:
        # In a grid the state without memory has another name than in the configuration of the insertion task, and an
        # action leaves no state.
        accepted = error.accepted.replace(f"{NONE}, last-action,", "symbols,")
        raise ConfigurationError("state", name, accepted) from error


def inferred(grid: GridMap, seed: int, walks: int, longest: int) -> StateIdentifier:
    """States of an automaton that is inferred from random walks in a map, as in the paper (section 4).

    Walks of more symbols than ``longest`` are left out; the seed gives them and the first weights of the networks.

    Raises:
        ConfigurationError: The walks make no set of strings that an automaton can be inferred from.
    """
    # Here, because it loads torch, which nothing else about grids needs.
    from palpate.core.automata import InferenceSettings, TrainingSettings, infer

    strings = walk_strings(grid, walks, seed, longest)
    found = infer(strings, InferenceSettings(training=TrainingSettings(seed=seed)))
    # Transitions that never occurred in the walks are not followed.
    return AutomatonState.of(found.machine, strings, symbols=grid.symbols)
