"""Learning runs in a grid world."""

import os
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import TypeAlias

from threadpoolctl import threadpool_limits

from palpate.adapters.config import HMM, TRIALS, GridLearning
from palpate.adapters.experiments.build import NONE, identifier
from palpate.adapters.files import read_text
from palpate.core.automata import AutomatonState
from palpate.core.errors import ConfigurationError
from palpate.core.perception import IdentityState, StateIdentifier
from palpate.core.policy import HmmLearner, TabularLearner, tabular_learner
from palpate.simulation.grid import (
    SCENARIOS,
    STEP_LIMIT,
    GridMap,
    Walk,
    belief_optimum,
    full_information_optimum,
    grid_actions,
    random_walk_steps,
    run_trial,
    walk_strings,
)


def grid_named(name: str, size: int) -> GridMap:
    """Return a map by name.

    Args:
        name: A scenario (1, 2 or twin), eight regions such as ``ABC/C.E/BDF``, or a text file with rows of letters.
        size: Side length in cells for a map of regions; a file has its own size.

    Raises:
        ConfigurationError: The map is unknown or invalid.
    """
    if name in SCENARIOS or (name.count("/") == 2 and not os.path.lexists(name)):
        return GridMap.from_regions(SCENARIOS.get(name, name), size)
    accepted = f"one of {', '.join(SCENARIOS)}, eight regions such as ABC/C.E/BDF, or a text file"
    return GridMap.from_text(read_text(Path(name), "map", accepted))


@dataclass(frozen=True, slots=True)
class Bounds:
    """Exact mean step counts from a random start; the belief-state optimum is None if its search takes too long."""

    full: float
    belief: float | None
    random_walk: float


@lru_cache(maxsize=16)
def bounds_of(grid: GridMap, step_limit: int = STEP_LIMIT) -> Bounds:
    """Return the bounds for a map."""
    try:
        belief = float(belief_optimum(grid))
    except ConfigurationError:
        belief = None
    return Bounds(float(full_information_optimum(grid)), belief, random_walk_steps(grid, step_limit))


def states_named(name: str, grid: GridMap) -> StateIdentifier:
    """Return the state identification for a map: ``symbols``, ``last-2``, ``last-3``, ..., or an automaton file.

    Raises:
        ConfigurationError: The name is unknown, there are too many states to learn, or the file is not an automaton
            over symbols of the map.
    """
    try:
        return identifier(NONE if name == "symbols" else name, grid.symbols)
    except ConfigurationError as error:
        # In a grid, the state without memory has a different name from that in the insertion task's configuration,
        # and the state does not depend on the last action.
        accepted = error.accepted.replace(f"{NONE}, last-action,", "symbols,")
        raise ConfigurationError("state", name, accepted) from error


def inferred(grid: GridMap, seed: int, walks: int, longest: int) -> StateIdentifier:
    """Return the states of an automaton inferred from random walks in a map, as in the paper (section 4).

    Walks with more than ``longest`` symbols are omitted; the seed determines the walks and the initial weights of the
    networks.

    Raises:
        ConfigurationError: No automaton can be inferred from the walks.
    """
    # Imported here, because it loads torch, which other grid functions do not need.
    from palpate.core.automata import InferenceSettings, TrainingSettings, infer

    strings = walk_strings(grid, walks, seed, longest)
    found = infer(strings, InferenceSettings(training=TrainingSettings(seed=seed)))
    # Transitions that did not occur in the walks are ignored.
    return AutomatonState.of(found.machine, strings, symbols=grid.symbols)


GridLearner: TypeAlias = TabularLearner | HmmLearner


def new_grid_learner(learning: GridLearning, identifier: StateIdentifier) -> GridLearner:
    """Return a new learner for these states.

    Raises:
        ConfigurationError: The hmm learner is requested for states other than the symbols.
    """
    if learning.learner == HMM:
        if not isinstance(identifier, IdentityState):
            accepted = f"symbols, with the learner {HMM}: it finds the hidden states itself"
            raise ConfigurationError("state", type(identifier).__name__, accepted)
        return HmmLearner(identifier.symbols, grid_actions(), learning.hmm())
    return tabular_learner(learning.parameters(), identifier.states, grid_actions())


@dataclass(frozen=True)
class LearningRun:
    """A learning run with its trials and its learned policy."""

    seed: int
    walks: tuple[Walk, ...]
    temperatures: tuple[float | None, ...]
    learner: GridLearner
    identifier: StateIdentifier

    @property
    def steps(self) -> list[int]:
        """Number of steps in each trial."""
        return [walk.steps for walk in self.walks]


def learn(
    grid: GridMap,
    identifier: StateIdentifier,
    learning: GridLearning,
    seed: int,
    trials: int = TRIALS,
    on_trial: Callable[[Walk], None] = lambda walk: None,
) -> LearningRun:
    """Learn from scratch. Only the seed and the index of a trial determine its start and choices.

    Raises:
        ConfigurationError: The states are defined over other symbols.
    """
    learner = new_grid_learner(learning, identifier)
    walks, temperatures = [], []
    # Use one thread: sums depend on how they are split, and threads do not speed up such small products.
    with threadpool_limits(limits=1):
        for trial in range(trials):
            walk = run_trial(grid, identifier, learner, seed, trial, step_limit=learning.step_limit)
            walks.append(walk)
            temperatures.append(learner.temperature)
            on_trial(walk)
    return LearningRun(seed, tuple(walks), tuple(temperatures), learner, identifier)
