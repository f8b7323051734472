"""What an agent may do in the insertion task: a compass step, or any step in the exploration plane."""

from __future__ import annotations

from abc import abstractmethod
from math import hypot, isfinite
from typing import Any, Final, Protocol

import numpy as np
from gymnasium import spaces

from palpate.adapters.gymnasium_envs.errors import ActionRefusedError
from palpate.adapters.gymnasium_envs.given import SOURCE
from palpate.core.policy import Action, Decision

KINDS: Final = ("discrete", "continuous")


class Actions(Protocol):
    """An action space, and what its actions mean to the core.

    Attributes:
        space: The action space.
    """

    space: spaces.Space[Any]

    @abstractmethod
    def decision(self, action: Any) -> Decision:
        """The core's decision.

        Raises:
            ActionRefusedError: There is no such action.
        """


def index_of(action: Any, count: int) -> int:
    """A discrete action as a plain number.

    Raises:
        ActionRefusedError: It is not a whole number from 0 to ``count - 1``.
    """
    # Some agents wrap the number into an array.
    number = action.item() if isinstance(action, np.ndarray) and action.size == 1 else action
    if not isinstance(number, (int, np.integer)) or isinstance(number, bool) or not 0 <= number < count:
        raise ActionRefusedError(f"action {action!r} is refused: a whole number from 0 to {count - 1}", action)
    return int(number)


class CompassSteps(Actions):
    """The steps that palpate's own learners choose from, in their order.

    Args:
        steps: The steps.
    """

    def __init__(self, steps: tuple[Action, ...]) -> None:
        self._steps = steps
        self.space = spaces.Discrete(len(steps))

    def decision(self, action: Any) -> Decision:
        """The compass step of that number."""
        index = index_of(action, len(self._steps))
        return Decision(self._steps[index], index, SOURCE)


class FreeSteps(Actions):
    """Steps in any direction, (2,) from -1 to 1: x and y as shares of the longest step.

    The tip moves at steady speed for the first 80 % of an action's time, so a step is a velocity too. No step is longer
    than the longest: the corners of the square are led back to the circle, in their direction.

    Args:
        longest_m: Length of the longest step.
    """

    def __init__(self, longest_m: float) -> None:
        self._longest_m = longest_m
        self.space = spaces.Box(-1.0, 1.0, (2,), np.float32)

    def decision(self, action: Any) -> Decision:
        """The step; it is none of a set, so no table learns from it."""
        try:
            x, y = (float(share) for share in action)
        except (TypeError, ValueError):
            raise _refused(action) from None
        if not (isfinite(x) and isfinite(y) and max(abs(x), abs(y)) <= 1.0):
            raise _refused(action)
        scale = self._longest_m / max(hypot(x, y), 1.0)
        return Decision(Action(f"({x:+.4f}, {y:+.4f})", (scale * x, scale * y)), None, SOURCE)


def _refused(action: Any) -> ActionRefusedError:
    return ActionRefusedError(f"action {action!r} is refused: two finite numbers from -1 to 1", action)
