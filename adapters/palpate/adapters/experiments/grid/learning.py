"""Learning runs in a grid world."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final, TypeAlias

from palpate.core.errors import ConfigurationError, require_in, require_one_of, require_whole
from palpate.core.perception import StateIdentifier
from palpate.core.policy import BackOff, QParameters, SarsaParameters, TabularLearner, TemperatureSchedule, new_learner
from palpate.simulation.grid.maps import GridMap, grid_actions
from palpate.simulation.grid.trial import STEP_LIMIT, Walk, run_trial

StateMaker: TypeAlias = Callable[[GridMap], StateIdentifier]
"""Makes the states of a map: each run gets an identifier of its own."""

TRIALS: Final = 1500
"""Trials of a run (paper, section 4)."""
RATES: Final = {"q": (0.5, 20.0, 0.05), "sarsa": (0.1, 0.0, 0.0)}
"""Of each learner the learning rate, the visits that halve it and its floor that did well with all kinds of state.

Chosen on seeds 0 to 3 of networks and 1000 to 1003 of learning.
"""

BACK_OFF: Final = {"q": 20.0, "sarsa": 0.0}
"""Of each learner the visits after which a state counts as much as its symbol.

Chosen, with the temperature, on seeds 0 to 7 of networks and 1000 to 1107 of learning.
"""


@dataclass(frozen=True)
class GridLearning:
    """How the agent learns. The penalty of an action is 1 and exploration is Boltzmann's, as in the insertion task.

    Raises:
        ConfigurationError: A value is out of its range.
    """

    learner: str = "q"
    """q: Q-learning; sarsa: Sarsa(lambda) with replacing traces."""
    alpha: float | None = None
    """Learning rate of the first visit. Without it: q 0.5, halved by 20 visits, down to 0.05; sarsa 0.1 throughout."""
    alpha_visits: float = 0.0
    """Visits that halve the learning rate given by alpha; 0 keeps it constant."""
    alpha_floor: float = 0.0
    """Lowest learning rate, beside alpha."""
    gamma: float = 1.0
    """Discount."""
    temperature: float = 0.5
    """Exploration temperature of the first trial."""
    temperature_decay: float = 0.995
    """Its factor from one trial to the next."""
    temperature_floor: float = 0.1
    """Its lowest value."""
    back_off: float | None = None
    """Visits after which a state's own experience counts as much as that of its last symbol, which stands in for it
    until then; 0 for never. Without it: q 20, sarsa never."""
    trace_decay: float = 0.8
    """Lambda of sarsa."""
    step_limit: int = STEP_LIMIT
    """Steps after which a trial ends without the goal."""

    def __post_init__(self) -> None:
        require_one_of("learner", self.learner, tuple(RATES))
        require_in("alpha_visits", self.alpha_visits, 0.0, 1e9)
        if self.alpha is None and (self.alpha_visits or self.alpha_floor):
            raise ConfigurationError("alpha", None, "a learning rate, if it is told how to fall")
        require_whole("step_limit", self.step_limit, 1, 1_000_000)
        require_in("back_off", self.back_off_visits, 0.0, 1e9)
        if self.back_off and self.learner != "q":
            raise ConfigurationError("back_off", self.back_off, "0; only the learner q can back off")
        try:
            self.parameters()
        except ConfigurationError as error:
            # The core does not know under which name the setting is given here.
            field = error.field.removeprefix("policy.")
            names = {f"temperature.{part}": f"temperature_{part}" for part in ("decay", "floor")}
            names["temperature.initial"] = "temperature"
            raise ConfigurationError(names.get(field, field), error.value, error.accepted) from error

    @property
    def back_off_visits(self) -> float:
        """The setting, or its default."""
        return BACK_OFF[self.learner] if self.back_off is None else self.back_off

    def parameters(self) -> QParameters:
        """Settings of the learner."""
        alpha, visits, floor = self.alpha, self.alpha_visits, self.alpha_floor
        if alpha is None:
            alpha, visits, floor = RATES[self.learner]
        settings: dict[str, Any] = {
            "alpha": alpha,
            "gamma": self.gamma,
            "temperature": TemperatureSchedule(self.temperature, self.temperature_decay, self.temperature_floor),
            "alpha_visits": visits or None,
            "alpha_floor": floor,
        }
        if self.learner == "sarsa":
            return SarsaParameters(**settings, trace_decay=self.trace_decay)
        return QParameters(**settings)

    def new_learner(self, identifier: StateIdentifier) -> TabularLearner:
        """A learner on these states that has learned nothing."""
        back_off = BackOff.of(self.back_off_visits, identifier.symbol_of)
        return new_learner(self.parameters(), identifier.states, grid_actions(), back_off=back_off)


@dataclass(frozen=True)
class LearningRun:
    """One run: every trial of it, and what was learned.

    Attributes:
        seed: Gives starts and choices.
        walks: The trials in their order.
        temperatures: Exploration temperature of each.
        learner: The learner afterwards.
        identifier: From symbols to its states.
    """

    seed: int
    walks: tuple[Walk, ...]
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
    tell: Callable[[Walk], None] = lambda walk: None,
) -> LearningRun:
    """Learn from scratch.

    Args:
        grid: The map.
        make_identifier: Makes the states.
        learning: Settings.
        seed: With the index of a trial it gives the start and the choices; nothing else does.
        trials: How many.
        tell: Hears of every trial.

    Raises:
        ConfigurationError: The states are over other symbols, or there are too many or too few trials.
    """
    require_whole("trials", trials, 1, 1_000_000)
    identifier = make_identifier(grid)
    learner = learning.new_learner(identifier)
    walks, temperatures = [], []
    for trial in range(trials):
        walk = run_trial(grid, identifier, learner, seed, trial, step_limit=learning.step_limit)
        walks.append(walk)
        temperatures.append(learner.temperature)
        tell(walk)
    return LearningRun(seed, tuple(walks), tuple(temperatures), learner, identifier)
