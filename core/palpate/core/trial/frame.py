"""The task frame (origin at the nominal goal, z into the hole) and the square exploration area."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi, sqrt
from typing import Final

import numpy as np
import pinocchio as pin

from palpate.core.trial.config import GoalConfig, TaskConfig

_TASK_IN_BASE: Final = np.diag([1.0, -1.0, -1.0])  # x along the base's x, z straight down into the hole


def goal_in_base(goal: GoalConfig) -> pin.SE3:
    """Return the task frame's placement in the base frame."""
    turned = pin.rpy.rpyToMatrix(*np.radians(goal.rpy_deg)) if any(goal.rpy_deg) else np.eye(3)
    rotation = pin.SE3(turned, np.zeros(3)) * pin.SE3(_TASK_IN_BASE, np.zeros(3))
    return pin.SE3(rotation.rotation, np.array([goal.x_mm, goal.y_mm, goal.z_mm]) * 1e-3)


def draw_in_disc(rng: np.random.Generator, radius_m: float, shape: str) -> tuple[float, float]:
    """Draw a random offset from the origin, (x, y) in m.

    Args:
        rng: Random number generator; a disc takes two numbers and a ball three.
        shape: ``disc``, uniform over the circle; ``ball``, uniform in a ball and projected onto the plane.
    """
    if shape == "ball":
        cosine = rng.uniform(-1.0, 1.0)
        radius = radius_m * float(rng.uniform()) ** (1 / 3) * sqrt(1.0 - cosine * cosine)
    else:
        radius = radius_m * sqrt(rng.uniform())
    heading = rng.uniform(0.0, 2 * pi)
    return float(radius * np.cos(heading)), float(radius * np.sin(heading))


@dataclass(frozen=True, slots=True)
class ExplorationArea:
    """A square in the task's XY plane, parallel to its axes."""

    centre_m: tuple[float, float]
    half_width_m: float

    @classmethod
    def of(cls, task: TaskConfig, start_m: tuple[float, float]) -> ExplorationArea:
        """Return the area for a trial that starts at ``start_m``."""
        return cls(start_m if task.area_centre == "start" else (0.0, 0.0), task.area_half_width_mm * 1e-3)

    def clamp(self, x_m: float, y_m: float) -> tuple[float, float]:
        """Return the nearest point inside the area."""
        (cx, cy), w = self.centre_m, self.half_width_m
        return min(max(x_m, cx - w), cx + w), min(max(y_m, cy - w), cy + w)
