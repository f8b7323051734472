"""Baseline strategies with the same interface as learned policies.

None of them learns. The oracles use the ground truth, which no port provides, and show the best possible result.
"""

from collections.abc import Callable, Sequence
from math import atan2, ceil, cos, hypot, pi, radians, sin, sqrt
from typing import Final

import numpy as np
import pinocchio as pin

from palpate.core.motion import tilt_rows
from palpate.core.policy import Action, ControllerKind, Decision, FixedPolicy, Observation, Spatial

_OVER_M: Final = 1e-3
"""Height above the plate at which a tilted tool touches nothing."""
_SAME: Final = 1e-3


class Baseline(FixedPolicy):
    """Base class for strategies without memory of past trials."""

    def __init__(self, name: str, actions: Sequence[Action]) -> None:
        super().__init__()
        self.name, self._actions = name, tuple(actions)

    def _move(self, dx_m: float, dy_m: float) -> Decision:
        return Decision(Action(self.name, (dx_m, dy_m)), None, self.name)

    def _compass(self, heading_rad: float) -> Decision:
        index = round(heading_rad / (2 * pi) * len(self._actions)) % len(self._actions)
        return Decision(self._actions[index], index, self.name)


class Oracle(Baseline):
    """Strategy that moves straight to the true hole; ``hole_m`` returns its task-frame position (x, y, ...)."""

    def __init__(self, hole_m: Callable[[], Sequence[float]], step_m: float) -> None:
        super().__init__("oracle", ())
        self._hole_m, self._step_m = hole_m, step_m

    def choose(self, observation: Observation) -> Decision:
        """Return a step towards the hole."""
        x, y, *_ = self._hole_m()
        dx, dy = x - observation.reference_m[0], y - observation.reference_m[1]
        shrink = min(1.0, self._step_m / max(hypot(dx, dy), 1e-12))
        return self._move(dx * shrink, dy * shrink)


class OraclePose(Baseline):
    """Strategy that moves above the true hole and into its true orientation, as fast as allowed, and then inserts.

    Args:
        pose: Function that returns the current trial's true hole, (x, y, z) in m in the task frame; the rotation
            vector (3,) in rad from the task's axes to the hole's; and, if drawn, ``heading_deg``.
        tilt_rad: Tilt of the peg in the grip.
        heading_deg: Heading of that tilt, unless it was drawn.
        step_m: Maximum step per action.
        turn_rad: Maximum rotation per action.
    """

    def __init__(
        self,
        pose: Callable[[], Sequence[float]],
        tilt_rad: float,
        heading_deg: float,
        step_m: float,
        turn_rad: float,
    ) -> None:
        super().__init__("oracle-pose", ())
        self._pose, self._tilt_rad, self._heading_deg = pose, tilt_rad, heading_deg
        self._longest = step_m, turn_rad

    def choose(self, observation: Observation) -> Decision:
        """Return one of several equal steps along the remaining path, or an insertion if above the hole."""
        x, y, _, *turned = self._pose()
        across = x - observation.reference_m[0], y - observation.reference_m[1]
        turn = [to - at for to, at in zip(self._turn_rad(turned), observation.turn_rad, strict=True)]
        actions = max(
            ceil(hypot(*left) / most - _SAME) for left, most in zip((across, turn), self._longest, strict=True)
        )
        if actions <= 0:
            return Decision(Action(self.name, (0.0, 0.0), Spatial(ControllerKind.INSERT)), None, self.name)
        tilt_x, tilt_y, yaw = (each / actions for each in turn)
        lift = Spatial(ControllerKind.LIFT, max(_OVER_M + observation.depth_m, 0.0), (tilt_x, tilt_y, yaw))
        return Decision(Action(self.name, (across[0] / actions, across[1] / actions), lift), None, self.name)

    def _turn_rad(self, turned: Sequence[float]) -> tuple[float, float, float]:
        """Return the tilt and yaw of the tool that align the peg, tilted in the grip, with the hole."""
        heading_rad = radians(turned[3] if len(turned) > 3 else self._heading_deg)
        tilt = pin.exp3(self._tilt_rad * np.array([-sin(heading_rad), cos(heading_rad), 0.0]))
        tool = pin.exp3(np.array(turned[:3] or (0.0, 0.0, 0.0))) @ tilt.T
        x, y, z = tool[:, 2].tolist()
        aside = hypot(x, y)
        tilt_x, tilt_y = (each * atan2(aside, z) / max(aside, _SAME) for each in (-y, x))
        upright = np.array(tilt_rows((tilt_x, tilt_y, 0.0))).T @ tool
        return tilt_x, tilt_y, atan2(upright[1, 0], upright[0, 0])


class TorqueFollowing(Baseline):
    """Hand-written rule that steps towards the hole as indicated by the torque, or at random below a torque threshold.

    A peg pressed near the hole is supported only on the side away from it, so the contact force has a lever arm about
    the tip: in the task frame the hole is at heading (-tau_y, tau_x).
    """

    def __init__(self, actions: Sequence[Action], threshold_Nm: float) -> None:
        super().__init__("torque", actions)
        self._threshold_Nm = threshold_Nm

    def choose(self, observation: Observation) -> Decision:
        """Return the compass step closest to the heading that the torque indicates."""
        tx, ty, _ = observation.torque_Nm
        if hypot(tx, ty) >= self._threshold_Nm or self._rng is None:
            return self._compass(atan2(tx, -ty))
        return self._compass(float(self._rng.uniform(0.0, 2 * pi)))


class Spiral(Baseline):
    """Archimedean spiral from the start of exploration; a pitch above twice the capture width leaves gaps."""

    def __init__(self, name: str, pitch_m: float, step_m: float) -> None:
        super().__init__(name, ())
        self._pitch_m, self._step_m = pitch_m, step_m
        self._centre = (0.0, 0.0)
        self._angle = 0.0

    def choose(self, observation: Observation) -> Decision:
        """Return the chord to the next point of the spiral."""
        x, y, _ = observation.reference_m
        if observation.action_number == 0:
            self._centre, self._angle = (x, y), 0.0
        # Use small angle increments, because the speed along the spiral depends on the radius.
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
