"""The expectation step of Baum-Welch over many trials at once, for hidden states that actions shift.

Forward and backward messages are scaled, and trials of different lengths end where they do. Sums run in one order on
every processor: no BLAS.
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
    """What was read and done in a trial, in turns.

    Attributes:
        symbols: Readings, the start's first; none at the goal.

    Raises:
        ConfigurationError: The numbers of readings and actions do not go together, or there is none.
    """

    symbols: tuple[int, ...]
    actions: tuple[int, ...]
    reached: bool

    def __post_init__(self) -> None:
        readings = len(self.actions) + (not self.reached)
        if len(self.symbols) != readings or readings == 0:
            raise ConfigurationError("trial.symbols", f"{len(self.symbols)} of them", _one_each(len(self.actions)))

    def to_dict(self) -> dict[str, Any]:
        """As plain JSON values."""
        return {"symbols": list(self.symbols), "actions": list(self.actions), "reached": self.reached}

    @classmethod
    def from_dict(cls, where: str, data: object, symbols: int, actions: int) -> Self:
        """From plain JSON values, over so many symbols and actions.

        Raises:
            ConfigurationError: It is none, or of another alphabet.
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
    """Trials side by side, the longest first; equal ones are one that weighs more.

    Attributes:
        symbols: Readings, (trials, longest); after a trial's end 0.
        weights: How many trials each stands for, (trials,).
        lengths: Number of readings of each, (trials,).
        reached: Whether each ended at the goal, (trials,).
        running: At each time how many trials have a reading; these are the first ones, (longest,).
    """

    symbols: Numbers
    actions: Numbers
    weights: NDArray[np.float64]
    lengths: Numbers
    reached: NDArray[np.bool_]
    running: tuple[int, ...]

    @classmethod
    def of(cls, trials: Sequence[RecordedTrial]) -> Self:
        """The trials, at least one."""
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


def _one_each(actions: int) -> str:
    return f"one for each of the {actions} actions, and the last one unless the goal was reached"


LEAST: Final = 1e-12
"""No reading is taken for less likely than this: a trial that a model holds for impossible must not end the fit."""


class Shifts:
    """Takes messages through one action: shifted by its displacement, or left where they are.

    Messages are rows by trial, (trials, states).

    Args:
        targets: Where each action leads from each state, (actions, states): its number, n at the goal, n + 1 nowhere.
        blocked: Probability that an action leaves a state as it is, (actions, states).
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
        """Probability of the first reading with each state."""
        joint: Floats = self._start * self.emitted[symbols]
        return joint

    def forward(self, before: Floats, actions: Numbers, following: Numbers) -> Floats:
        """Probability of the next reading with each state after it."""
        moved = _padded(before * self._free[actions])
        joint = before * self.blocked[actions]
        joint += np.take_along_axis(moved, self._sources[actions], axis=1)
        joint *= self.emitted[following]
        return joint

    def backward(self, after: Floats, actions: Numbers, following: Numbers) -> Floats:
        """Probability of the next reading and all that follows, from each state before it."""
        joint = after * self.emitted[following]
        moved = np.take_along_axis(_padded(joint), self._targets[actions], axis=1)
        moved *= self._free[actions]
        joint *= self.blocked[actions]
        joint += moved
        return joint

    def stays(self, before: Floats, after: Floats, actions: Numbers, following: Numbers) -> Floats:
        """Probability that the action left each state as it was."""
        joint = before * after
        joint *= self.blocked[actions]
        joint *= self.emitted[following]
        return joint

    def goals(self, batch: Batch) -> Floats:
        """Probability that the last action of each trial leads to the goal, from each state."""
        return self._goal[batch.actions[np.arange(len(batch.lengths)), batch.lengths - 1]]


@dataclass(frozen=True, slots=True)
class Expected:
    """What trials show by a model.

    Attributes:
        visits: Times that each symbol was read in each state, by the action that followed, the last one for none,
            (actions + 1, symbols, states).
        stays: Times that an action left a state as it was, (actions, states).
        starts: Times that a trial started in each state, (states,).
        log_likelihood: Of all trials, their arrivals at the goal included.
    """

    visits: Floats
    stays: Floats
    starts: Floats
    log_likelihood: float


def expected_counts(batch: Batch, shifts: Shifts) -> Expected:
    """Count by the posterior of the hidden states."""
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
    """Forward messages at each time, (running trials, states), and the log-likelihood of each trial, (trials,)."""
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
        message[scale < LEAST] = 1.0  # lost: anywhere
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
    """Sum of the rows that have each key, (groups, ...), in the rows' order."""
    order = np.argsort(keys, kind="stable")
    present, begins = np.unique(keys[order], return_index=True)
    result = np.zeros((groups, *rows.shape[1:]))
    if len(present):
        result[present] = np.add.reduceat(rows[order], begins, axis=0)
    return result
