"""The discrete actions: fixed steps of the tip in compass directions (paper, section 5.4)."""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, hypot, isfinite, pi, sin, sqrt
from typing import Final

from palpate.core.errors import ConfigurationError

COMPASS_NAMES: Final = ("+x", "+x+y", "+y", "-x+y", "-x", "-x-y", "-y", "+x-y")


@dataclass(frozen=True, slots=True)
class Action:
    """One action of a policy.

    Attributes:
        name: What people and files call it.
        displacement_m: XY displacement of the tip during the action, (2,), in the task frame.
    """

    name: str
    displacement_m: tuple[float, float]

    def __post_init__(self) -> None:
        if not isfinite(hypot(*self.displacement_m)):
            raise ConfigurationError("actions.displacement_m", self.displacement_m, "two finite lengths in m")


def compass_actions(step_m: float, directions: int = 8) -> tuple[Action, ...]:
    """Steps of equal length in equally spaced directions, from +x counter-clockwise.

    Args:
        step_m: Length of each step.
        directions: How many; eight are named like ``"+x-y"``, other numbers by angle (``"120deg"``).

    Raises:
        ConfigurationError: The step is not positive or there are fewer than two directions.
    """
    if not (isfinite(step_m) and step_m > 0.0):
        raise ConfigurationError("actions.step_m", step_m, "a finite length above 0 m")
    if directions < 2:
        raise ConfigurationError("actions.directions", directions, "a whole number from 2 up")
    names = COMPASS_NAMES if directions == 8 else [f"{360 * k / directions:g}deg" for k in range(directions)]
    units = (_unit_vector(k, directions) for k in range(directions))
    return tuple(Action(name, (step_m * x, step_m * y)) for name, (x, y) in zip(names, units, strict=True))


def _unit_vector(k: int, directions: int) -> tuple[float, float]:
    """Direction ``k``: turned by whole quarters, so that axes have true zeros and opposites cancel."""
    quarters, rest = divmod(4 * k, directions)
    if 2 * rest == directions:
        x = y = sqrt(0.5)  # cos and sin of 45 degrees differ in the last bit, and between machines
    else:
        angle_rad = 0.5 * pi * rest / directions
        x, y = cos(angle_rad), sin(angle_rad)
    for _ in range(quarters):
        x, y = 0.0 - y, x  # 0.0 - y rather than -y: no negative zero
    return x, y
