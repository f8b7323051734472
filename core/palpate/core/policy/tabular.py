"""Base class for tabular learners, with a Q table, Boltzmann exploration, and settings."""

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

import numpy as np
from typing_extensions import override

from palpate.core.errors import ConfigurationError
from palpate.core.policy.base import LEARNED, Action, Decision, Observation, Transition, check_names, drawing_from
from palpate.core.policy.exploration import TemperatureSchedule, boltzmann
from palpate.core.policy.learner import Learner
from palpate.core.ports import Discount, HalvingVisits, LearningRate, Range, Settings, fitted, require_floor


@dataclass(frozen=True, slots=True, kw_only=True)
class QParameters(Settings):
    """Settings for a tabular learner.

    The learning rate for a state-action pair after n visits is ``max(alpha_floor, alpha / (1 + n / alpha_visits))``; if
    ``alpha_visits`` is 0, it is ``alpha``.
    """

    TABLE: ClassVar[str] = "policy"

    alpha: LearningRate
    """Learning rate at the first visit."""
    gamma: Discount
    """Discount factor; the paper uses 1."""
    temperature: TemperatureSchedule
    """Exploration temperature."""
    alpha_visits: HalvingVisits = 0.0
    """Number of visits after which the learning rate is halved; 0 keeps it constant."""
    alpha_floor: Annotated[float, Range(0.0, 1.0)] = 0.0
    """Lower bound on the learning rate, at most ``alpha``."""
    initial_value: float = 0.0
    """Q value before the first visit."""

    @override
    def check(self) -> None:
        require_floor(self.dotted("alpha_floor"), self.alpha_floor, self.alpha, "alpha")

    def learning_rate(self, visits: int) -> float:
        """Return the learning rate for a pair after ``visits`` visits."""
        if not self.alpha_visits:
            return self.alpha
        return max(self.alpha_floor, self.alpha / (1.0 + visits / self.alpha_visits))


class TabularLearner(Learner):
    """Learner with Boltzmann exploration over a Q table; subclasses define how the table is learned.

    Args:
        frozen: True disables learning and uses the temperature for frozen policies.

    Raises:
        ConfigurationError: A value is out of range, or a name is repeated.
    """

    def __init__(
        self,
        states: Sequence[str],
        actions: Sequence[Action],
        parameters: QParameters,
        *,
        frozen: bool = False,
    ) -> None:
        check_names(states, actions)
        self.states, self.actions, self.frozen = tuple(states), tuple(actions), frozen
        self.parameters = parameters
        self._temperature = self._temperature_of(0)
        self._q = [[float(parameters.initial_value)] * len(self.actions) for _ in self.states]
        self._visits = [[0] * len(self.actions) for _ in self.states]
        self._trial_counted = False
        self._rng: np.random.Generator | None = None

    @property
    def temperature(self) -> float:
        """Return the temperature for the current trial."""
        return self._temperature

    @property
    def q(self) -> tuple[tuple[float, ...], ...]:
        """Return the Q value for each state and action."""
        return tuple(map(tuple, self._q))

    @property
    def visits(self) -> tuple[tuple[int, ...], ...]:
        """Return the number of updates for each state and action."""
        return tuple(map(tuple, self._visits))

    def serves(self, state: int) -> bool:
        """Return True for every state."""
        return state < len(self.states)

    def begin_trial(self, trial: int, rng: np.random.Generator) -> None:
        """Set the temperature for the trial and take its random numbers from ``rng``."""
        self._rng = rng
        self._trial_counted = False
        self._temperature = self._temperature_of(trial)

    def _temperature_of(self, trial: int) -> float:
        schedule = self.parameters.temperature
        return schedule.when_frozen if self.frozen else schedule.at(trial)

    def choose(self, observation: Observation) -> Decision:
        """Draw an action by Boltzmann exploration, with exactly one random number."""
        return self._decision(self._drawn(observation.state))

    def learn(self, transition: Transition) -> None:
        """Update the table, unless frozen."""
        if self.frozen:
            return
        after = 0.0 if transition.next_state is None else self._value(transition.next_state, transition)
        target = transition.reinforcement + self.parameters.gamma * after
        self._update(transition.state, transition.action_index, target)
        self._count(transition.state, transition.action_index)

    @abstractmethod
    def _value(self, state: int, transition: Transition) -> float:
        """Return the next state's value."""

    @abstractmethod
    def _update(self, state: int, action: int, target: float) -> None:
        """Move a pair's Q value towards a target."""

    def _drawn(self, state: int) -> int:
        return boltzmann(self._q[state], self._temperature, drawing_from(self._rng, type(self).__name__))

    def _decision(self, index: int) -> Decision:
        return Decision(self.actions[index], index, LEARNED)

    def _count(self, state: int, action: int) -> None:
        self._visits[state][action] += 1
        if not self._trial_counted:
            self._trial_counted = True
            self._trials_learned += 1

    @override
    def get_state(self) -> dict[str, Any]:
        return {
            "q": [list(row) for row in self._q],
            "visits": [list(row) for row in self._visits],
            "trials_learned": self._trials_learned,
            "trial_counted": self._trial_counted,
            "temperature": self._temperature,
        }

    @override
    def set_state(self, state: Mapping[str, Any]) -> None:
        q, visits = self._rows(state, "q", float), self._rows(state, "visits", Annotated[int, Range(0)])
        trials = fitted("learner.trials_learned", state.get("trials_learned"), Annotated[int, Range(0)])
        counted = fitted("learner.trial_counted", state.get("trial_counted"), bool)
        temperature = fitted("learner.temperature", state.get("temperature"), float)
        # Change nothing until everything has been checked.
        self._q, self._visits, self._temperature = q, visits, temperature
        self._trials_learned, self._trial_counted = trials, counted

    def _rows(self, state: Mapping[str, Any], key: str, kind: Any) -> list[list[Any]]:
        """Return the rows of a saved table, one per learner state, with one number per action."""
        rows: tuple[tuple[Any, ...], ...] = fitted(f"learner.{key}", state.get(key), tuple[tuple[kind, ...], ...])
        if [len(row) for row in rows] != [len(self.actions)] * len(self.states):
            accepted = f"{len(self.states)} rows of {len(self.actions)} numbers"
            raise ConfigurationError(f"learner.{key}", f"{len(rows)} rows", accepted)
        return [list(row) for row in rows]


class QLearning(TabularLearner):
    """Q-learning: ``Q(i, a) <- (1 - alpha) Q(i, a) + alpha (r + gamma V(j))``, with ``V(j) = max_a Q(j, a)``.

    The value of the goal is 0. If another policy acts in ``j`` (see
    :class:`~palpate.core.policy.programmed.MixedPolicy`), ``V(j)`` is the Q value of its action.
    """

    def _value(self, state: int, transition: Transition) -> float:
        values, bound = self._q[state], transition.next_action_index
        return max(values) if bound is None else values[bound]

    def _update(self, state: int, action: int, target: float) -> None:
        alpha = self.parameters.learning_rate(self._visits[state][action])
        self._q[state][action] = (1.0 - alpha) * self._q[state][action] + alpha * target
