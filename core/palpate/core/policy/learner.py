"""Base classes for all learners, and for learners with a model, a belief and a planner."""

from abc import abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from math import inf
from typing import Annotated, Any, Final, Generic, Protocol, TypeVar

import numpy as np
from typing_extensions import override

from palpate.core.policy.base import Policy, Transition
from palpate.core.ports import Range, fitted, require_keys


@dataclass(frozen=True, slots=True)
class TaskBounds:
    """Task bounds for a learner with a model.

    Attributes:
        half_width_m: Half the side length of the square around the nominal goal that contains the hole and the tip.
        longest_m: Longest step that an action completes within the force limit.
    """

    half_width_m: float
    action_s: float
    longest_m: float = inf


ANY_BOUNDS: Final = TaskBounds(1e-3, 0.1)
"""Bounds for a learner created only to read its state."""


class Learner(Policy):
    """A policy that learns. Code that records, resumes or replays its trials uses only these members."""

    frozen: bool
    _trials_learned = 0

    @property
    def trials_learned(self) -> int:
        """Return the number of trials from which the learner has learned."""
        return self._trials_learned

    @abstractmethod
    def get_state(self) -> dict[str, Any]:
        """Return everything that learning has changed, as plain JSON values that preserve every bit.

        It may be called during a trial, after ``begin_trial`` and after ``end_trial``. A learner that is set to this
        state and begins the same trial continues identically. The caller's random number generator is not included.
        """

    @abstractmethod
    def set_state(self, state: Mapping[str, Any]) -> None:
        """Restore the state returned by :meth:`get_state`.

        Raises:
            ConfigurationError: The state belongs to a learner with a different size; nothing is changed.
        """


class Remembered(Protocol):
    """A trial that is stored for fitting a model."""

    def to_dict(self) -> dict[str, Any]:
        """Return the trial as plain JSON values."""
        ...


T = TypeVar("T", bound=Remembered)


class ModelLearner(Learner, Generic[T]):
    """Learner that fits a model to whole trials, tracks a belief over hidden quantities, and plans with both.

    The model is fitted between trials and only read during a trial. It is a function of the remembered trials, which
    are therefore the learner's state.
    """

    def __init__(self, *, frozen: bool) -> None:
        self.frozen = frozen
        self._trials: list[T] = []
        self._fitted_to: list[T] | None = None

    @override
    def begin_trial(self, trial: int, rng: np.random.Generator) -> None:
        self._refit()
        self._begin(rng)

    def learn(self, transition: Transition) -> None:
        """Ignore individual steps, because their value is known only at the end of the trial."""

    def get_state(self) -> dict[str, Any]:
        """Return the remembered trials as plain JSON values; the model is fitted to them again."""
        return {"trials": [trial.to_dict() for trial in self._trials], "trials_learned": self._trials_learned}

    @override
    def set_state(self, state: Mapping[str, Any]) -> None:
        require_keys("learner", state, ("trials", "trials_learned"))
        given: tuple[Any, ...] = fitted("learner.trials", state["trials"], tuple[Any, ...])
        count = fitted("learner.trials_learned", state["trials_learned"], Annotated[int, Range(0)])
        trials = [self._trial_from(f"learner.trials[{k}]", data) for k, data in enumerate(given)]
        self._trials, self._trials_learned = trials, count

    @abstractmethod
    def _trial_from(self, where: str, data: object) -> T:
        """Read a trial from plain JSON values."""

    def _remember(self, trial: T) -> None:
        """Add a trial."""
        self._trials.append(trial)
        self._trials_learned += 1

    def _refit(self) -> None:
        """Fit the model again if the remembered trials have changed."""
        if self._fitted_to != self._trials:
            self._fitted_to = list(self._trials)
            self._fit()

    @abstractmethod
    def _fit(self) -> None:
        """Fit the model."""

    @abstractmethod
    def _begin(self, rng: np.random.Generator) -> None:
        """Begin a trial with the prior belief."""
