"""What learners by a model have in common: the model, a belief over what is hidden, a planner on both."""

from abc import abstractmethod
from typing import Any, Generic, Protocol, TypeVar

import numpy as np
from typing_extensions import override

from palpate.core.policy.base import Transition
from palpate.core.policy.learner import Learner


class Remembered(Protocol):
    """A trial as a model is fitted to it."""

    def to_dict(self) -> dict[str, Any]:
        """As plain JSON values."""
        ...


T = TypeVar("T", bound=Remembered)


class ModelLearner(Learner, Generic[T]):
    """Learns a model from whole trials, tracks a belief over what is hidden, and acts by a plan on both.

    Between trials the model is fitted; while one runs it is only read. The model follows from the trials that are
    remembered, so these are the state of the learner.
    """

    def __init__(self, *, frozen: bool) -> None:
        self.frozen = frozen
        self._trials: list[T] = []
        self._trials_learned = 0
        self._fitted_to: list[T] | None = None

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

    @override
    def get_state(self) -> dict[str, Any]:
        """The trials that are remembered, as plain JSON values; what was fitted follows from them."""
        return {"trials": [trial.to_dict() for trial in self._trials], "trials_learned": self._trials_learned}

    def _remember(self, trial: T) -> None:
        """Learn from one more trial."""
        self._trials.append(trial)
        self._trials_learned += 1

    def _refit(self) -> None:
        """Fit the model to the trials that are remembered, if there are other ones than before."""
        if self._fitted_to != self._trials:
            self._fitted_to = list(self._trials)
            self._fit()

    @abstractmethod
    def _fit(self) -> None:
        """Fit the model."""

    @abstractmethod
    def _begin(self, rng: np.random.Generator) -> None:
        """Begin a trial: with the belief before any evidence."""
