"""Learning runs in a grid world."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

from threadpoolctl import threadpool_limits

from palpate.adapters.config import HMM, TRIALS, GridLearning
from palpate.core.errors import ConfigurationError
from palpate.core.perception import IdentityState, StateIdentifier
from palpate.core.policy import HmmLearner, TabularLearner, tabular_learner
from palpate.simulation.grid import GridMap, Walk, grid_actions, run_trial

GridLearner: TypeAlias = TabularLearner | HmmLearner


def new_grid_learner(learning: GridLearning, identifier: StateIdentifier) -> GridLearner:
    """A learner on these states that has learned nothing.

    Raises:
        ConfigurationError: The learner hmm is to learn on other states than the symbols.
    """
    if learning.learner == HMM:
        if not isinstance(identifier, IdentityState):
            accepted = f"symbols, with the learner {HMM}: it finds the hidden states itself"
            raise ConfigurationError("state", type(identifier).__name__, accepted)
        return HmmLearner(identifier.symbols, grid_actions(), learning.hmm())
    return tabular_learner(learning.parameters(), identifier.states, grid_actions())


@dataclass(frozen=True)
class LearningRun:
    """One run: every trial of it, and what was learned."""

    seed: int
    walks: tuple[Walk, ...]
    temperatures: tuple[float | None, ...]
    learner: GridLearner
    identifier: StateIdentifier

    @property
    def steps(self) -> list[int]:
        """Steps of each trial."""
        return [walk.steps for walk in self.walks]


def learn(
    grid: GridMap,
    identifier: StateIdentifier,
    learning: GridLearning,
    seed: int,
    trials: int = TRIALS,
    on_trial: Callable[[Walk], None] = lambda walk: None,
) -> LearningRun:
    """Learn from scratch. Start and choices of a trial follow from the seed and its index, and from nothing else.

    Raises:
        ConfigurationError: The states are over other symbols.
    """
    learner = new_grid_learner(learning, identifier)
    walks, temperatures = [], []
    # Sums depend on how they are split, and threads would wait for each other over such small products.
    with threadpool_limits(limits=1):
        for trial in range(trials):
            walk = run_trial(grid, identifier, learner, seed, trial, step_limit=learning.step_limit)
            walks.append(walk)
            temperatures.append(learner.temperature)
            on_trial(walk)
    return LearningRun(seed, tuple(walks), tuple(temperatures), learner, identifier)
