"""For pegs with corners: one corner goes in first, pushed into its corner of the hole, which turns the tool right."""

from __future__ import annotations

from enum import Enum
from math import cos, hypot, pi, radians, sin
from typing import Final

import numpy as np
from typing_extensions import override

from palpate.core.errors import ConfigurationError
from palpate.core.policy import Action, Decision, FixedPolicy, Law, Observation, Spatial
from palpate.core.tasks.insertion_6dof.options import SpatialOptions

NAME: Final = "corner-first"
_LEANING_ACTIONS: Final = 5
"""In fewer, a wrist would have to be faster than it may be."""
_RISE_M: Final = 2e-3
_WALL_N: Final = 1.5
_QUIET_NM: Final = 0.012
_QUIET_ACTIONS: Final = 3
"""So many actions in a row both walls have to carry, and nothing to turn the tool."""
_LONGEST_PUSH: Final = 25
_STAND_RAD: Final = radians(0.8)
_UPRIGHT_RAD: Final = radians(0.1)


class _Stage(Enum):
    LEAN = "lean"
    PUSH = "push"
    STAND = "stand"
    INSERT = "insert"


class CornerFirst(FixedPolicy):
    """Leans over a corner, pushes it at both walls until nothing turns it, stands up, inserts; else the next corner.

    Pressed flat, nothing shows a peg's yaw against the hole's. One corner in the hole, pushed at both walls, does.

    Args:
        options: Corners, lean and push.

    Raises:
        ConfigurationError: The peg has no corners.
    """

    def __init__(self, options: SpatialOptions) -> None:
        super().__init__()
        if options.corners < 3:
            raise ConfigurationError("task.options.corners", options.corners, f"3 or more for the policy {NAME}")
        self._options, self._half_rad = options, pi / int(options.corners)
        self._inside_m, self._radius_m = options.inside_mm * 1e-3, options.corner_mm * 1e-3
        self._lean_rad, self._push_N = radians(options.lean_deg), 2.0 * options.push_N * cos(self._half_rad)

    @override
    def begin_trial(self, trial: int, rng: np.random.Generator) -> None:
        super().begin_trial(trial, rng)
        self._begin_corner(0)

    def _begin_corner(self, corner: int) -> None:
        self._corner, self._stage, self._left = corner, _Stage.LEAN, _LEANING_ACTIONS
        self._heading_rad = (2 * corner + 1) * self._half_rad
        self._quiet = self._pushed = 0

    @override
    def choose(self, observation: Observation) -> Decision:
        """The next action of the stage."""
        if self._stage is _Stage.LEAN and not self._left:
            self._stage = _Stage.PUSH
        elif self._stage is _Stage.PUSH:
            self._judge_push(observation)
        elif self._stage is _Stage.INSERT:
            # The insertion came to nothing.
            self._begin_corner(self._corner + 1)
        lean = hypot(*observation.turn_rad[:2])
        if self._stage is _Stage.STAND and lean < _UPRIGHT_RAD:
            self._stage = _Stage.INSERT
        displacement_m, spatial = (0.0, 0.0), Spatial(Law.INSERT)
        if self._stage is _Stage.LEAN:
            displacement_m, spatial = self._leaning(observation)
        elif self._stage is _Stage.PUSH:
            spatial = self._pushing(observation, 0.0)
        elif self._stage is _Stage.STAND:
            spatial = self._pushing(observation, min(1.0, _STAND_RAD / lean))
        return Decision(Action(self._stage.value, displacement_m, spatial), None, NAME, (float(self._corner),))

    def _judge_push(self, observation: Observation) -> None:
        self._pushed += 1
        (x, y, _), heading = observation.force_N, self._heading_rad + observation.turn_rad[2]
        walls = [-x * cos(heading + side) - y * sin(heading + side) for side in (-self._half_rad, self._half_rad)]
        quiet = min(walls) > _WALL_N and abs(observation.torque_Nm[2]) < _QUIET_NM
        self._quiet = self._quiet + 1 if quiet else 0
        if self._quiet == _QUIET_ACTIONS:
            self._stage = _Stage.STAND
        elif self._pushed == _LONGEST_PUSH:
            self._begin_corner(self._corner + 1)

    def _leaning(self, observation: Observation) -> tuple[tuple[float, float], Spatial]:
        """Up, and in equal parts over the corner and to the lean."""
        (x, y, _), (lean_x, lean_y, yaw) = observation.reference_m, observation.turn_rad
        c, s, left = cos(self._heading_rad), sin(self._heading_rad), self._left
        rise_m = _RISE_M if left == _LEANING_ACTIONS else 0.0
        self._left -= 1
        turn = (s * self._lean_rad - lean_x) / left, (-c * self._lean_rad - lean_y) / left, -yaw / left
        displacement_m = (-self._inside_m * c - x) / left, (-self._inside_m * s - y) / left
        return displacement_m, Spatial(Law.LIFT, rise_m, turn)

    def _pushing(self, observation: Observation, upright: float) -> Spatial:
        """At both walls, standing up by this share of the lean; the corner stays in its place."""
        lean_x, lean_y, yaw = observation.turn_rad
        c, s = cos(self._heading_rad + yaw), sin(self._heading_rad + yaw)
        turn = -upright * lean_x, -upright * lean_y, 0.0
        push = self._push_N * c, self._push_N * s
        return Spatial(Law.PUSH, 0.0, turn, push, (self._radius_m * c, self._radius_m * s))
