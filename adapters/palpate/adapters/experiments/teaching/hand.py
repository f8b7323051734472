"""What a person teaches with, as the loop has it."""

from abc import ABC, abstractmethod
from math import atan2, hypot, pi
from typing import Self

from palpate.core.policy import COMPASS_NAMES, Observation


class Hand(ABC):
    """A keyboard or a gamepad. A context manager, for what it opens."""

    _ended: bool = False

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        return

    def end(self) -> None:
        """The lesson is to end. Safe to call from a signal handler."""
        self._ended = True

    def ended(self) -> bool:
        """Whether the person has ended the lesson."""
        return self._ended

    @abstractmethod
    def wait(self) -> None:
        """A trial is about to begin: return when the person is ready for it, or the lesson is over."""

    @property
    @abstractmethod
    def held(self) -> bool:
        """Whether the arm may move by itself."""

    @abstractmethod
    def step(self, observation: Observation) -> int | None:
        """Index of the compass step that the person wants now; None for a rest.

        Raises:
            DeviceError: The device is gone.
        """


def compass_index(x: float, y: float, least: float) -> int | None:
    """The compass step that is nearest to a direction; None for one shorter than ``least``, in the same unit."""
    if hypot(x, y) < least:
        return None
    count = len(COMPASS_NAMES)
    return round(atan2(y, x) / (2.0 * pi / count)) % count
