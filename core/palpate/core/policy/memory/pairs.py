"""Q-learning on what was last read and done: tables for ever longer pasts, from short to long, and trials replayed.

A past is the last few readings with the actions between them. A table of the long ones tells places apart that a symbol
does not, and fills slowly; those of the shorter ones stand in until it has. A trial that ended is learned from again
later on, backwards, so that what the goal is worth comes to the start of the way at once.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any, Final, Self, TypeAlias

import numpy as np
from typing_extensions import override

from palpate.core.errors import ConfigurationError
from palpate.core.policy.base import (
    LEARNED,
    Action,
    Decision,
    Hindsight,
    Observation,
    Transition,
    check_names,
    drawing_from,
)
from palpate.core.policy.exploration import TemperatureSchedule, boltzmann
from palpate.core.policy.learner import Learner
from palpate.core.policy.memory.recorded import RecordedTrial
from palpate.core.policy.tabular import QParameters
from palpate.core.ports import require_keys

Past: TypeAlias = tuple[int, ...]
"""Readings and the actions between them in turns, the last reading last."""

PAIRS_PARAMETERS: Final = QParameters(
    alpha=0.5,
    alpha_visits=20.0,
    alpha_floor=0.05,
    gamma=0.97,
    initial_value=-4.0,
    temperature=TemperatureSchedule(1.0, 0.995, 0.05),
)
"""Settings that did well on maps of all sizes."""
PAIRS: Final = "pairs"
LONGEST: Final = 4
_TRUSTED: Final = 3.0  # visits after which a longer past counts as much as all the shorter ones
_REPLAYED: Final = 20
_WEARY: Final = 1.0  # what an action of a frozen learner loses with each time that it was taken in vain
_PENALTY: Final = -1.0


class PairsLearner(Learner):
    """Learns the value of each action after the last one to ``longest`` readings with the actions between them.

    The values of a past are mixed from short to long: a longer one that was tried n times counts n / (n + 3). After
    each trial some that are stored are learned from again.

    While it learns, values of what leads round in a circle sink at once. Those of a frozen learner stay; so it counts
    what it did in this trial, and an action that was taken before after the same two readings is worth less.

    Args:
        symbols: Names of the symbols; these are the states that it is asked in.
        back_off: Mix in the shorter pasts; without it only the longest counts.
        frozen: Learn nothing more, and keep the temperature of the schedule for that.

    Raises:
        ConfigurationError: Names repeat.
    """

    def __init__(
        self,
        symbols: Sequence[str],
        actions: Sequence[Action],
        parameters: QParameters = PAIRS_PARAMETERS,
        *,
        longest: int = LONGEST,
        back_off: bool = True,
        frozen: bool = False,
    ) -> None:
        check_names(symbols, actions)
        self.states, self.actions, self.parameters = tuple(symbols), tuple(actions), parameters
        self.longest, self.back_off, self.frozen = longest, back_off, frozen
        # Of each past the values of the actions and how often each was learned from.
        self._tables: dict[Past, tuple[list[float], list[int]]] = {}
        self._trials: list[RecordedTrial] = []
        self._temperature = parameters.temperature.at(0)
        self._rng: np.random.Generator | None = None
        self._forget()

    def _forget(self) -> None:
        self._symbols: list[int] = []
        self._actions: list[int] = []
        self._next: int | None = None
        self._taken: Counter[tuple[Past, int]] = Counter()

    @property
    @override
    def temperature(self) -> float:
        return self._temperature

    @property
    @override
    def trials_learned(self) -> int:
        return len(self._trials)

    @property
    def pasts(self) -> int:
        """Number of pasts that were met."""
        return len(self._tables)

    def as_frozen(self) -> Self:
        """A learner with these values that changes nothing."""
        other = type(self)(
            self.states, self.actions, self.parameters, longest=self.longest, back_off=self.back_off, frozen=True
        )
        other.set_state(self.get_state())
        return other

    @override
    def serves(self, state: int) -> bool:
        return state < len(self.states)

    @override
    def begin_trial(self, trial: int, rng: np.random.Generator) -> None:
        schedule = self.parameters.temperature
        self._rng, self._temperature = rng, schedule.when_frozen if self.frozen else schedule.at(trial)
        self._forget()

    @override
    def choose(self, observation: Observation) -> Decision:
        """Draw an action by Boltzmann exploration.

        Raises:
            LifecycleError: No trial has begun.
        """
        self._symbols.append(observation.state)
        values = self.values(self.past_of(self._symbols, self._actions))
        recent = (*self._symbols[-2:], *self._actions[-1:])
        values = [v - _WEARY * self._taken[recent, action] for action, v in enumerate(values)]
        index = boltzmann(values, self._temperature, drawing_from(self._rng, type(self).__name__))
        self._taken[recent, index] += self.frozen
        return Decision(self.actions[index], index, LEARNED)

    def past_of(self, symbols: Sequence[int], actions: Sequence[int]) -> Past:
        """The longest past that counts, after these readings and the actions between them."""
        count = min(len(symbols), self.longest)
        turns = zip(actions[len(actions) - count + 1 :] if count > 1 else (), symbols[-count + 1 :], strict=False)
        return (symbols[-count], *(number for turn in turns for number in turn)) if count > 1 else (symbols[-1],)

    def values(self, past: Past) -> list[float]:
        """Values of the actions after a past, (actions,)."""
        values = [self.parameters.initial_value] * len(self.actions)
        for shorter in self._mixed(past):
            if (table := self._tables.get(shorter)) is not None:
                if not self.back_off:
                    return table[0]
                shares = [n / (n + _TRUSTED) for n in table[1]]
                values = [v + share * (q - v) for v, share, q in zip(values, shares, table[0], strict=True)]
        return values

    def _mixed(self, past: Past) -> list[Past]:
        """The past and the shorter ones that count too, the shortest first."""
        return [past[begin:] for begin in range(len(past) - 1, -1, -2)] if self.back_off else [past]

    @override
    def learn(self, transition: Transition) -> None:
        """Take note of what was done and read, and update the values of what was done."""
        self._actions.append(transition.action_index)
        self._next = transition.next_state
        if not self.frozen:
            self._learn(self._symbols, self._actions, transition.next_state, 1)

    def _learn(self, symbols: Sequence[int], actions: Sequence[int], after: int | None, visit: int) -> None:
        """Update the values of the last action.

        Args:
            after: What was read after it; None at the goal.
            visit: 1 if it is new experience, 0 if it is replayed.
        """
        action, target = actions[-1], _PENALTY
        if after is not None:
            target += self.parameters.gamma * max(self.values(self.past_of([*symbols, after], actions)))
        for past in self._mixed(self.past_of(symbols, actions[:-1])):
            blank = [self.parameters.initial_value] * len(self.actions), [0] * len(self.actions)
            values, visits = self._tables.setdefault(past, blank)
            values[action] += self.parameters.learning_rate(visits[action]) * (target - values[action])
            visits[action] += visit

    @override
    def end_trial(self, hindsight: Hindsight) -> None:
        """Store the trial, and learn again from some that are stored, backwards."""
        if self.frozen or not self._actions:
            return
        symbols = self._symbols if self._next is None else [*self._symbols, self._next]
        self._trials.append(RecordedTrial(tuple(symbols), tuple(self._actions), self._next is None))
        rng = drawing_from(self._rng, type(self).__name__)
        for place in rng.integers(len(self._trials), size=_REPLAYED):
            self._replay(self._trials[int(place)])

    def _replay(self, trial: RecordedTrial) -> None:
        for time in range(len(trial.actions) - 1, -1, -1):
            after = trial.symbols[time + 1] if time + 1 < len(trial.symbols) else None
            begin = max(0, time + 1 - self.longest)
            self._learn(trial.symbols[begin : time + 1], trial.actions[begin : time + 1], after, 0)

    @override
    def get_state(self) -> dict[str, Any]:
        tables = [[list(past), list(values), list(visits)] for past, (values, visits) in sorted(self._tables.items())]
        trials = [trial.to_dict() for trial in self._trials]
        return {"tables": tables, "trials": trials, "temperature": self._temperature}

    @override
    def set_state(self, state: Mapping[str, Any]) -> None:
        require_keys("learner", state, ("tables", "trials", "temperature"))
        actions = len(self.actions)
        for number, (past, values, visits) in enumerate(state["tables"]):
            strange = len(values) != actions or len(visits) != actions or len(past) > 2 * self.longest - 1
            if strange or max(past[::2]) >= len(self.states) or max(past[1::2], default=0) >= actions:
                accepted = f"a past of {len(self.states)} symbols and a value for each of {actions} actions"
                raise ConfigurationError(f"learner.tables[{number}]", past, accepted)
        sizes = len(self.states), actions
        trials = [
            RecordedTrial.from_dict(f"learner.trials[{k}]", data, *sizes) for k, data in enumerate(state["trials"])
        ]
        self._tables = {
            tuple(past): ([float(value) for value in values], [int(count) for count in visits])
            for past, values, visits in state["tables"]
        }
        self._trials, self._temperature = trials, float(state["temperature"])
