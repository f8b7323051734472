"""Which trial an episode is: palpate numbers trials within a seed, Gymnasium only seeds."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

import numpy as np

from palpate.core.checks import require_whole
from palpate.core.errors import ConfigurationError

_MOST_TRIALS: Final = 1_000_000_000


class Numbering:
    """Episodes after ``reset(seed=s)`` are the trials 0, 1, 2, ... of the seed s, whatever happened before."""

    def __init__(self) -> None:
        self._seed: int | None = None
        self._next = 0

    def next(self, seed: int | None, options: Mapping[str, Any] | None, rng: np.random.Generator) -> tuple[int, int]:
        """Seed and index of the next episode's trial.

        Args:
            seed: A new seed; its trials begin at 0.
            options: ``{"trial": k}`` goes to that trial; those after it follow.
            rng: Draws a seed where none was ever given, as Gymnasium has it.

        Raises:
            ConfigurationError: An option is unknown or refused.
        """
        if options is not None and not isinstance(options, Mapping):
            raise ConfigurationError("options", options, 'a table such as {"trial": 3}, or None')
        trial = None
        for name, value in (options or {}).items():
            if name != "trial":
                raise ConfigurationError(f"options.{name}", value, "no such option; there is trial")
            trial = value
        if trial is not None:
            require_whole("options.trial", trial, 0, _MOST_TRIALS)
        if seed is not None:
            require_whole("seed", seed, 0, 2**63 - 1)
            self._seed, self._next = seed, 0
        elif self._seed is None:
            self._seed = int(rng.integers(2**31))
        return self._seed, self._next if trial is None else trial

    def passed(self, trial: int) -> None:
        """This trial has begun; the one after it comes next."""
        self._next = trial + 1
