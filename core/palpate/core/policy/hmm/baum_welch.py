"""Baum-Welch expectation step over a batch of trials, for hidden states shifted by actions.

Forward and backward messages are scaled, and trials may differ in length. BLAS is not used, so that sums have the same
order on every processor.
"""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final, Self

import numpy as np
from numpy.typing import NDArray

from palpate.core.errors import ConfigurationError
from palpate.core.policy.belief import Floats, logarithm
from palpate.core.ports import fitted, require_keys

Numbers = NDArray[np.intp]


@dataclass(frozen=True, slots=True)
class RecordedTrial:
    """Alternating readings and actions from one trial.

    Attributes:
        symbols: Readings from the start onwards; there is no reading at the goal.

    Raises:
        ConfigurationError: The numbers of readings and actions do not match, or there is no reading.
    """

    symbols: tuple[int, ...]
    actions: tuple[int, ...]
    reached: bool

    def __post_init__(self) -> None:
        readings = len(self.actions) + (not self.reached)
        if len(self.symbols) != readings or readings == 0:
            accepted = f"one for each of the {len(self.actions)} actions, and the last one unless the goal was reached"
            raise ConfigurationError("trial.symbols", f"{len(self.symbols)} of them", accepted)

    def to_dict(self) -> dict[str, Any]:
        """Return the trial as plain JSON values."""
        return {"symbols": list(self.symbols), "actions": list(self.actions), "reached": self.reached}

    @classmethod
    def from_dict(cls, where: str, data: object, symbols: int, actions: int) -> Self:
        """Return a trial from plain JSON values.

        Args:
            symbols: Number of symbols.
            actions: Number of actions.

        Raises:
            ConfigurationError: The data are not a trial, or a number is out of range.
        """
        given = fitted(where, data, Mapping[str, Any])
        require_keys(where, given, ("symbols", "actions", "reached"))
        for key, count in (("symbols", symbols), ("actions", actions)):
            strange = next(
                (n for n in fitted(f"{where}.{key}", given[key], tuple[int, ...]) if not 0 <= n < count), None
            )
            if strange is not None:
                raise ConfigurationError(f"{where}.{key}", strange, f"numbers from 0 to {count - 1}")
        reached = fitted(f"{where}.reached", given["reached"], bool)
        return cls(tuple(given["symbols"]), tuple(given["actions"]), reached)


@dataclass(frozen=True, slots=True)
class Batch:
    """A batch of trials, longest first; identical trials form one row with a higher weight.

    Attributes:
        symbols: Readings, (trials, longest); 0 after the end of a trial.
        weights: Number of identical trials in each row, (trials,).
        lengths: Number of readings in each trial, (trials,).
        reached: True for each trial that ended at the goal, (trials,).
        running: Number of trials with a reading at each time, (longest,); these trials are the first rows.
    """

    symbols: Numbers
    actions: Numbers
    weights: NDArray[np.float64]
    lengths: Numbers
    reached: NDArray[np.bool_]
    running: tuple[int, ...]

    @classmethod
    def of(cls, trials: Sequence[RecordedTrial]) -> Self:
        """Create a batch from at least one trial."""
        counts = Counter(trials)
        order = sorted(counts, key=lambda trial: -len(trial.symbols))
        longest = len(order[0].symbols)
        symbols = np.zeros((len(order), longest), dtype=np.intp)
        actions = np.zeros((len(order), longest), dtype=np.intp)
        for row, trial in enumerate(order):
            symbols[row, : len(trial.symbols)] = trial.symbols
            actions[row, : len(trial.actions)] = trial.actions
        lengths = np.array([len(trial.symbols) for trial in order], dtype=np.intp)
        return cls(
            symbols,
            actions,
            np.array([counts[trial] for trial in order], dtype=np.float64),
            lengths,
            np.array([trial.reached for trial in order]),
            tuple(int((lengths > time).sum()) for time in range(longest)),
        )


LEAST: Final = 1e-12
"""Lower limit on a reading's probability, so that a trial ruled out by a model does not abort the fit."""


class Shifts:
    """Message propagation through one action, which shifts a state by its displacement or leaves it unchanged.

    Messages have one row per trial, (trials, states).

    Args:
        targets: Target of each action from each state, (actions, states): a state, n for the goal, or n + 1 for an
            unknown state.
        blocked: Probability that an action leaves a state unchanged, (actions, states).
        start: Probability of each state at the start, (states,).
        emissions: Probability of each symbol, (states, symbols).
    """

    def __init__(self, targets: Numbers, blocked: Floats, start: Floats, emissions: Floats) -> None:
        count = len(start)
        self.actions, self.symbols, self.states = len(targets), int(emissions.shape[1]), count
        self.blocked = np.where(targets == count + 1, 1.0, blocked)
        self._free = 1.0 - self.blocked
        self._targets = np.minimum(targets, count)
        self._sources = np.full((len(targets), count), count, dtype=np.intp)
        for action, row in enumerate(targets):
            inside = np.flatnonzero(row < count)
            self._sources[action, row[inside]] = inside
        self._goal = np.where(targets == count, self._free, 0.0)
        self._start = start
        self.emitted = np.ascontiguousarray(emissions.T)

    def first(self, symbols: Numbers) -> Floats:
        """Return the joint probability of the first reading and each state."""
        joint: Floats = self._start * self.emitted[symbols]
        return joint

    def forward(self, before: Floats, actions: Numbers, following: Numbers) -> Floats:
        """Return the joint probability of the next reading and the state after the action."""
        moved = _padded(before * self._free[actions])
        joint = before * self.blocked[actions]
        joint += np.take_along_axis(moved, self._sources[actions], axis=1)
        joint *= self.emitted[following]
        return joint

    def backward(self, after: Floats, actions: Numbers, following: Numbers) -> Floats:
        """Return the probability of the next and all later readings, given the state before the action."""
        joint = after * self.emitted[following]
        moved = np.take_along_axis(_padded(joint), self._targets[actions], axis=1)
        moved *= self._free[actions]
        joint *= self.blocked[actions]
        joint += moved
        return joint

    def stays(self, before: Floats, after: Floats, actions: Numbers, following: Numbers) -> Floats:
        """Return the unnormalised probability that the action left each state unchanged."""
        joint = before * after
        joint *= self.blocked[actions]
        joint *= self.emitted[following]
        return joint

    def goals(self, batch: Batch) -> Floats:
        """Return the probability that the last action of each trial leads to the goal, for each state."""
        return self._goal[batch.actions[np.arange(len(batch.lengths)), batch.lengths - 1]]


@dataclass(frozen=True, slots=True)
class Expected:
    """Expected counts for a batch of trials under a model.

    Attributes:
        visits: Number of times that each symbol was read in each state, for each next action, (actions + 1, symbols,
            states); the last index denotes no action.
        stays: Number of times that an action left a state unchanged, (actions, states).
        starts: Number of trials that started in each state, (states,).
        log_likelihood: Log-likelihood of all trials, including their arrivals at the goal.
    """

    visits: Floats
    stays: Floats
    starts: Floats
    log_likelihood: float


def expected_counts(batch: Batch, shifts: Shifts) -> Expected:
    """Return the expected counts under the posterior over the hidden states."""
    goals = shifts.goals(batch)
    messages, log_likelihood = _forward(batch, shifts, goals)
    keys: list[Numbers] = []
    rows: list[Floats] = []
    stay_keys: list[Numbers] = [np.zeros(0, dtype=np.intp)]
    stay_rows: list[Floats] = [np.zeros((0, shifts.states))]
    after = np.empty((0, shifts.states))
    for time in range(len(batch.running) - 1, -1, -1):
        running, longer = batch.running[time], len(after)
        message, weights = messages[time], batch.weights[:running]
        here = np.where(batch.reached[longer:running, None], goals[longer:running], 1.0)
        if longer:
            move = batch.actions[:longer, time], batch.symbols[:longer, time + 1]
            here = np.concatenate((shifts.backward(after, *move), here))
        joint = message * here
        share = (weights / np.maximum(joint.sum(axis=1), LEAST * LEAST)).astype(joint.dtype)
        acted = (batch.lengths[:running] > time + 1) | batch.reached[:running]
        taken = np.where(acted, batch.actions[:running, time], shifts.actions)
        keys.append(taken * shifts.symbols + batch.symbols[:running, time])
        rows.append(joint * share[:, None])
        if longer:
            stay_keys.append(move[0])
            stay_rows.append(shifts.stays(message[:longer] * share[:longer, None], after, *move))
        after = here / np.maximum(here.max(axis=1, keepdims=True), LEAST * LEAST)
    groups = (shifts.actions + 1, shifts.symbols, shifts.states)
    visits = _sums_by(np.concatenate(keys), np.concatenate(rows), groups[0] * groups[1]).reshape(groups)
    stays = _sums_by(np.concatenate(stay_keys), np.concatenate(stay_rows), shifts.actions)
    return Expected(visits, stays, rows[-1].sum(axis=0), float((log_likelihood * batch.weights).sum()))


def _forward(batch: Batch, shifts: Shifts, goals: Floats) -> tuple[list[Floats], Floats]:
    """Return the forward messages at each time, (running, states), and the log-likelihood of each trial, (trials,)."""
    messages: list[Floats] = []
    scales = np.ones(batch.symbols.shape)
    for time, running in enumerate(batch.running):
        if time == 0:
            message = shifts.first(batch.symbols[:, 0])
        else:
            rows = slice(0, running)
            message = shifts.forward(messages[-1][rows], batch.actions[rows, time - 1], batch.symbols[rows, time])
        scale = message.sum(axis=1)
        scales[:running, time] = np.maximum(scale, LEAST)
        message[scale < LEAST] = 1.0  # the model rules the reading out: restart from a uniform distribution
        scale = message.sum(axis=1)
        messages.append(message / scale[:, None])
    last = np.stack([messages[length - 1][row] for row, length in enumerate(batch.lengths)])
    ends = np.where(batch.reached, (last * goals).sum(axis=1), 1.0)
    return messages, logarithm(scales).sum(axis=1) + logarithm(np.maximum(ends, LEAST))


def _padded(rows: Floats) -> Floats:
    result = np.empty((rows.shape[0], rows.shape[1] + 1))
    result[:, :-1], result[:, -1] = rows, 0.0
    return result


def _sums_by(keys: Numbers, rows: Floats, groups: int) -> Floats:
    """Return the sum of the rows for each key, (groups, ...), added in row order."""
    order = np.argsort(keys, kind="stable")
    present, begins = np.unique(keys[order], return_index=True)
    result = np.zeros((groups, *rows.shape[1:]))
    if len(present):
        result[present] = np.add.reduceat(rows[order], begins, axis=0)
    return result
