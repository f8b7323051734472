"""What learners by a model have in common: the model, a belief over what is hidden, a planner on both."""

from __future__ import annotations

from abc import abstractmethod

import numpy as np
from typing_extensions import override

from palpate.core.policy.base import Transition
from palpate.core.policy.learner import Learner


class ModelLearner(Learner):
    """Learns a model from whole trials, tracks a belief over what is hidden, and acts by a plan on both.

    Between trials the model is fitted; while one runs it is only read. The model follows from the trials that are
    remembered, so these are the state of the learner.

    Args:
        frozen: Learn nothing more.
    """

    def __init__(self, *, frozen: bool = False) -> None:
        self.frozen = frozen
        self._trials_learned = 0
        self._changed = True

    @property
    @override
    def temperature(self) -> float | None:
        return None

    @property
    @override
    def trials_learned(self) -> int:
        return self._trials_learned

    @override
    def serves(self, state: int) -> bool:
        return True

    @override
    def begin_trial(self, trial: int, rng: np.random.Generator) -> None:
        self._refit()
        self._begin(rng)

    @override
    def learn(self, transition: Transition) -> None:
        """A single step teaches nothing here: what it was worth is known at the end."""

    def _refit(self) -> None:
        """Fit the model to the trials that are remembered, if there are other ones than before."""
        if self._changed:
            self._changed = False
            self._fit()

    @abstractmethod
    def _fit(self) -> None:
        """Fit the model."""

    @abstractmethod
    def _begin(self, rng: np.random.Generator) -> None:
        """Begin a trial: with the belief before any evidence."""
