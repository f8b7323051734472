"""What a policy that learns has beside what every policy has: what it has learned, to be saved and taken up again."""

from abc import abstractmethod
from collections.abc import Mapping
from typing import Any

from palpate.core.policy.base import Policy


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
