"""What all motion laws have in common."""

from __future__ import annotations

from abc import abstractmethod
from math import sqrt
from typing import Protocol

from palpate.core.values import Vector3


class ControlLaw(Protocol):
    """Computes the velocity that the tip's reference shall have until the next control tick."""

    @abstractmethod
    def velocity_m_s(self, reference_m: Vector3, target_m: Vector3, force_N: Vector3) -> Vector3:
        """Tip velocity, (3,), in the task frame.

        Args:
            reference_m: Where the tip is commanded to be now, (3,), task frame.
            target_m: Where the action wants it to end, (3,), task frame.
            force_N: Force of the environment on the tool, tared, not low-pass filtered, (3,), task frame.
        """

    def reset(self) -> None:
        """Forget the past; called when an action of another law begins."""


def limited(velocity_m_s: Vector3, speed_limit_m_s: float) -> Vector3:
    """The velocity, shortened to the speed limit with its direction kept."""
    x, y, z = velocity_m_s
    square = x * x + y * y + z * z
    if square <= speed_limit_m_s * speed_limit_m_s:
        return velocity_m_s
    shrink = speed_limit_m_s / sqrt(square)
    return x * shrink, y * shrink, z * shrink
