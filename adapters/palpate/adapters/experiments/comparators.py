"""Strategies to compare with, behind the same interface as learned policies.

None of them learns. The omniscient one is given the truth, which no port carries: it marks what is possible.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import atan2, cos, hypot, pi, sin, sqrt

from palpate.core.policy import Action, Decision, FixedPolicy, Observation


class Comparator(FixedPolicy):
    """What strategies without memory of past trials have in common."""

    def __init__(self, name: str, actions: Sequence[Action]) -> None:
        super().__init__()
        self.name, self._actions = name, tuple(actions)

    def _move(self, dx_m: float, dy_m: float) -> Decision:
        return Decision(Action(self.name, (dx_m, dy_m)), None, self.name)

    def _compass(self, heading_rad: float) -> Decision:
        index = round(heading_rad / (2 * pi) * len(self._actions)) % len(self._actions)
        return Decision(self._actions[index], index, self.name)


class Omniscient(Comparator):
    """Straight to the true hole.

    Args:
        hole_m: Gives the true hole, (x, y, ...) in the task frame, of the trial that runs.
    """

    def __init__(self, hole_m: Callable[[], Sequence[float]], step_m: float) -> None:
        super().__init__("omniscient", ())
        self._hole_m, self._step_m = hole_m, step_m

    def choose(self, observation: Observation) -> Decision:
        """A step towards the hole."""
        x, y, *_ = self._hole_m()
        dx, dy = x - observation.reference_m[0], y - observation.reference_m[1]
        shrink = min(1.0, self._step_m / max(hypot(dx, dy), 1e-12))
        return self._move(dx * shrink, dy * shrink)


class TorqueFollowing(Comparator):
    """The hand-written rule: step where the torque points at the hole; where it is below the threshold, step anywhere.

    Pressed beside the hole, the peg is supported on the far side only, so the force passes the tip at a distance:
    in the task frame the hole is at heading (-tau_y, tau_x).
    """

    def __init__(self, actions: Sequence[Action], threshold_Nm: float) -> None:
        super().__init__("torque", actions)
        self._threshold_Nm = threshold_Nm

    def choose(self, observation: Observation) -> Decision:
        """The compass step nearest to the torque's heading."""
        tx, ty, _ = observation.torque_Nm
        if hypot(tx, ty) >= self._threshold_Nm or self._rng is None:
            return self._compass(atan2(tx, -ty))
        return self._compass(float(self._rng.uniform(0.0, 2 * pi)))


class Spiral(Comparator):
    """Archimedean spiral from where exploration begins, at constant speed.

    Args:
        pitch_m: Distance between turns; at most twice the capture width, or it leaves gaps.
    """

    def __init__(self, name: str, pitch_m: float, step_m: float) -> None:
        super().__init__(name, ())
        self._pitch_m, self._step_m = pitch_m, step_m
        self._centre = (0.0, 0.0)
        self._angle = 0.0

    def choose(self, observation: Observation) -> Decision:
        """The chord to the next point of the spiral."""
        x, y, _ = observation.reference_m
        if observation.action_number == 0:
            self._centre, self._angle = (x, y), 0.0
        # Small increments of angle, because speed along the spiral depends on the radius.
        travelled = 0.0
        while travelled < self._step_m:
            radius = self._pitch_m * self._angle / (2 * pi)
            slope = sqrt(radius * radius + (self._pitch_m / (2 * pi)) ** 2)
            increment = min(0.05, (self._step_m - travelled) / slope + 1e-9)
            travelled += slope * increment
            self._angle += increment
        radius = self._pitch_m * self._angle / (2 * pi)
        cx, cy = self._centre
        return self._move(cx + radius * cos(self._angle) - x, cy + radius * sin(self._angle) - y)


class StraightPass(Comparator):
    """On and on in one direction; it measures the capture width.

    Attributes:
        heading_rad: The direction, from x towards y of the task frame.
    """

    def __init__(self, step_m: float) -> None:
        super().__init__("straight pass", ())
        self.heading_rad = 0.0
        self._step_m = step_m

    def choose(self, observation: Observation) -> Decision:
        """One more step in the same direction."""
        return self._move(self._step_m * cos(self.heading_rad), self._step_m * sin(self.heading_rad))
