"""Trials as pairs of what was read and what was then done, and many of them side by side for a fit."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from palpate.core.errors import ConfigurationError
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
