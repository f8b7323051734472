"""Learning runs in a grid world."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

from palpate.adapters.config import TRIALS, GridLearning
from palpate.core.automata import AutomatonState
from palpate.core.errors import require_whole
from palpate.core.perception import StateIdentifier
from palpate.core.policy import BackOff, TabularLearner, new_learner
from palpate.simulation.grid import GridMap, Walk, grid_actions, run_trial

StateMaker: TypeAlias = Callable[[GridMap], StateIdentifier]
"""Makes the states of a map: each run gets an identifier of its own."""


def new_grid_learner(learning: GridLearning, identifier: StateIdentifier) -> TabularLearner:
    """A learner on these states that has learned nothing."""
    back_off = BackOff.of(learning.back_off_visits, identifier.symbol_of)
    return new_learner(learning.parameters(), identifier.states, grid_actions(), back_off=back_off)


@dataclass(frozen=True)
class LearningRun:
    """One run: every trial of it, and what was learned.

    Attributes:
        lost_steps: Of each trial the symbols that its automaton had no transition for; 0 where the states are others.
    """

    seed: int
    walks: tuple[Walk, ...]
    lost_steps: tuple[int, ...]
    temperatures: tuple[float, ...]
    learner: TabularLearner
    identifier: StateIdentifier

    @property
    def steps(self) -> list[int]:
        """Steps of each trial."""
        return [walk.steps for walk in self.walks]


def learn(
    grid: GridMap,
    make_identifier: StateMaker,
    learning: GridLearning,
    seed: int,
    trials: int = TRIALS,
    on_trial: Callable[[Walk], None] = lambda walk: None,
) -> LearningRun:
    """Learn from scratch. Start and choices of a trial follow from the seed and its index, and from nothing else.

    Raises:
        ConfigurationError: The states are over other symbols, or there are too many or too few trials.
    """
    require_whole("trials", trials, 1, 1_000_000)
    identifier = make_identifier(grid)
    learner = new_grid_learner(learning, identifier)
    walks, lost_steps, temperatures = [], [], []
    for trial in range(trials):
        walk = run_trial(grid, identifier, learner, seed, trial, step_limit=learning.step_limit)
        walks.append(walk)
        lost_steps.append(identifier.lost_steps if isinstance(identifier, AutomatonState) else 0)
        temperatures.append(learner.temperature)
        on_trial(walk)
    return LearningRun(seed, tuple(walks), tuple(lost_steps), tuple(temperatures), learner, identifier)
