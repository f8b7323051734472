"""Q-learning on what was last read and done: tables for ever longer pasts, from short to long, and trials replayed.

A past is the last few readings with the actions between them. A table of the long ones tells places apart that a symbol
does not, and fills slowly; those of the shorter ones stand in until it has. A trial that ended is learned from again
later on, backwards, so that what the goal is worth comes to the start of the way at once.

Where a past does not tell all, the value of the next one is that of several places. So what a trial really came to
counts in part when it is replayed (Peng and Williams, 1996), and a frozen learner acts by running means of the values,
which go up and down with the last few trials.
"""

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
Table: TypeAlias = tuple[list[float], list[int], list[float]]
"""Of one past the values of the actions, how often each was learned from, and the running means of the values."""

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
RETURNED: Final = 0.4
_TRUSTED: Final = 3.0  # visits after which a longer past counts as much as all the shorter ones
_REPLAYED: Final = 20
_WEARY: Final = 1.0  # what an action of a frozen learner loses with each time that it was taken in vain
_PENALTY: Final = -1.0
_LAGGING: Final = 0.05  # how far a running mean goes towards a value with each update


class PairsLearner(Learner):
    """Learns the value of each action after the last one to ``longest`` readings with the actions between them.

    The values of a past are mixed from short to long: a longer one that was tried n times counts n / (n + 3). After
    each trial some that are stored are learned from again.

    While it learns, values of what leads round in a circle sink at once. Those of a frozen learner stay; so it counts
    what it did in this trial, and an action that was taken before after the same two readings is worth less.

    Args:
        symbols: Names of the symbols; these are the states that it is asked in.
        returned: Of a replayed trial, how much of what is yet to come it says itself, from 0 to 1.
        frozen: Learn nothing more, and keep the temperature of the schedule for that.

    Raises:
        ConfigurationError: Names repeat.
    """

    def __init__(
        self,
        symbols: Sequence[str],
        actions: Sequence[Action],
        *,
        longest: int = LONGEST,
        returned: float = RETURNED,
        frozen: bool = False,
    ) -> None:
        check_names(symbols, actions)
        self.states, self.actions, self.parameters = tuple(symbols), tuple(actions), PAIRS_PARAMETERS
        self.longest, self.returned, self.frozen = longest, returned, frozen
        self._tables: dict[Past, Table] = {}
        self._trials: list[RecordedTrial] = []
        self._temperature = self.parameters.temperature.at(0)
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
        other = type(self)(self.states, self.actions, longest=self.longest, returned=self.returned, frozen=True)
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
        return self._values(self._mixed(past))

    def _values(self, mixed: Sequence[Past]) -> list[float]:
        values = [self.parameters.initial_value] * len(self.actions)
        for past in mixed:
            if (table := self._tables.get(past)) is not None:
                learned = table[2] if self.frozen else table[0]
                values = [v + n / (n + _TRUSTED) * (q - v) for v, n, q in zip(values, table[1], learned, strict=True)]
        return values

    def _mixed(self, past: Past) -> list[Past]:
        """The past and the shorter ones that count too, the shortest first."""
        return [past[begin:] for begin in range(len(past) - 1, -1, -2)]

    @override
    def learn(self, transition: Transition) -> None:
        """Take note of what was done and read, and update the values of what was done."""
        self._actions.append(transition.action_index)
        self._next = transition.next_state
        if self.frozen:
            return
        target, after = _PENALTY, transition.next_state
        if after is not None:
            target += self.parameters.gamma * max(self.values(self.past_of([*self._symbols, after], self._actions)))
        self._update(self._mixed(self.past_of(self._symbols, self._actions[:-1])), self._actions[-1], target, 1)

    def _update(self, mixed: Sequence[Past], action: int, target: float, visit: int) -> None:
        """Move the values of an action towards a target.

        Args:
            visit: 1 if it is new experience, 0 if it is replayed.
        """
        for past in mixed:
            if (table := self._tables.get(past)) is None:
                blank = [self.parameters.initial_value] * len(self.actions)
                table = self._tables[past] = blank, [0] * len(blank), list(blank)
            values, visits, means = table
            before = visits[action]
            values[action] += self.parameters.learning_rate(before) * (target - values[action])
            means[action] += max(_LAGGING, 1.0 / (1.0 + before)) * (values[action] - means[action])
            visits[action] = before + visit

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
        following: list[Past] | None = None
        returned = None
        if len(trial.symbols) > len(trial.actions):
            following = self._pasts_at(trial, len(trial.actions))
        for time in range(len(trial.actions) - 1, -1, -1):
            target = _PENALTY
            if following is not None:
                best = max(self._values(following))
                if returned is not None:
                    best += self.returned * (returned - best)
                target += self.parameters.gamma * best
            following, returned = self._pasts_at(trial, time), target
            self._update(following, trial.actions[time], target, 0)

    def _pasts_at(self, trial: RecordedTrial, time: int) -> list[Past]:
        begin = max(0, time + 1 - self.longest)
        return self._mixed(self.past_of(trial.symbols[begin : time + 1], trial.actions[begin:time]))

    @override
    def get_state(self) -> dict[str, Any]:
        tables = [[list(past), *(row[:] for row in table)] for past, table in sorted(self._tables.items())]
        trials = [trial.to_dict() for trial in self._trials]
        return {"tables": tables, "trials": trials, "temperature": self._temperature}

    @override
    def set_state(self, state: Mapping[str, Any]) -> None:
        require_keys("learner", state, ("tables", "trials", "temperature"))
        actions = len(self.actions)
        tables = []
        for number, raw in enumerate(state["tables"]):
            past, *rows = raw if isinstance(raw, list) else (raw,)
            whole = isinstance(past, list) and all(isinstance(row, list) and len(row) == actions for row in rows)
            if not whole or len(rows) not in {2, 3} or not self._met(past) or min(rows[1]) < 0:
                accepted = (
                    f"a past of {len(self.states)} symbols, and a value and a count for each of {actions} actions"
                )
                raise ConfigurationError(f"learner.tables[{number}]", past, accepted)
            # Tables without running means are of those who acted by the values.
            tables.append((past, *rows, rows[0]) if len(rows) == 2 else (past, *rows))
        sizes = len(self.states), actions
        trials = [
            RecordedTrial.from_dict(f"learner.trials[{k}]", data, *sizes) for k, data in enumerate(state["trials"])
        ]
        self._tables = {
            tuple(past): ([float(v) for v in values], [int(n) for n in visits], [float(v) for v in means])
            for past, values, visits, means in tables
        }
        self._trials, self._temperature = trials, float(state["temperature"])

    def _met(self, past: Sequence[int]) -> bool:
        """Whether it is a past of these symbols and actions."""
        sizes = [len(self.actions) if place % 2 else len(self.states) for place in range(len(past))]
        fits = all(0 <= number < size for number, size in zip(past, sizes, strict=True))
        return fits and len(past) % 2 == 1 and len(past) < 2 * self.longest
