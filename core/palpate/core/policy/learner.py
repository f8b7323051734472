"""What policies that learn have in common, and what those by a model do: the model, a belief, a planner on both."""

from abc import abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, Final, Generic, Protocol, TypeVar

import numpy as np
from typing_extensions import override

from palpate.core.policy.base import Policy, Transition
from palpate.core.ports import Range, fitted, require_keys


@dataclass(frozen=True, slots=True)
class Reach:
    """What of a task a learner by a model has to know.

    Attributes:
        half_width_m: Half the side of the square about the nominal goal in which the hole, and the tip, may be.
    """

    half_width_m: float
    action_s: float


ANY_REACH: Final = Reach(1e-3, 0.1)
"""For a learner that is made only to read what it has learned."""


class Learner(Policy):
    """A policy that learns. Whoever records, resumes or replays its trials needs no more of it than this."""

    frozen: bool

    @property
    @abstractmethod
    def trials_learned(self) -> int:
        """Number of trials in which it learned anything."""

    @abstractmethod
    def get_state(self) -> dict[str, Any]:
        """All that learning has changed, as plain JSON values that keep every bit.

        It may be asked for in a trial, after ``begin_trial`` and after ``end_trial``; a learner that is set to it and
        begins the same trial goes on as this one. The random generator belongs to the caller and is not in it.
        """

    @abstractmethod
    def set_state(self, state: Mapping[str, Any]) -> None:
        """Go back to what :meth:`get_state` gave.

        Raises:
            ConfigurationError: It is the state of a learner of another size; nothing is changed then.
        """


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
