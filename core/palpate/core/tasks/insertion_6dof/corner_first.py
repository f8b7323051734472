"""For pegs with corners or a flat: one goes in first, pushed into its place in the hole, which turns the tool right."""

from __future__ import annotations

from dataclasses import replace
from enum import Enum
from math import ceil, copysign, cos, hypot, pi, radians, sin
from typing import Final

import numpy as np
from typing_extensions import override

from palpate.core.errors import ConfigurationError
from palpate.core.policy import Action, Decision, FixedPolicy, Law, Observation, Spatial
from palpate.core.tasks.insertion_6dof.options import SpatialOptions

NAME: Final = "corner-first"
_LEAN_RAD: Final = radians(1.1)
"""By so much an action at most, or a wrist near its singularity would have to be faster than it can be."""
_RISE_M: Final = 2.2e-3
_ON_PLATE_M: Final = 0.6e-3
"""A leaning tip that is lower by no more than this than one whose corner stands on the plate is not in the hole."""
_CAUGHT_N: Final = 1.5
"""A tool that feels more across its axis is caught on an edge: straight up first."""
_WALL_N: Final = 1.5
_FREE_N: Final = 1.2
_LEAD_M: Final = 0.1e-3
"""The tool is led on by so much an action while less than that force, friction's, is felt on each wall."""
_QUIET_NM: Final = 0.012
_QUIET_ACTIONS: Final = 2
"""So many actions in a row both walls have to carry, and nothing to turn the tool."""
_CAUGHT_M: Final = 0.5e-3
"""A tip that is less deep below the plate hangs on a wall though both of them carry."""
_FLAT_M: Final = 1e-3
"""A flat is let down so far and no further, or the peg's sides would wedge in the hole and hold what it should turn."""
_HANGS_M: Final = 0.15e-3
"""A flat that is higher by more hangs on an edge."""
_ASIDE_M: Final = 1.5e-3
"""There is one flat: it is tried again so far aside, on one side and the other."""
_FLAT_ON_PLATE: Final = 0.8
"""A leaning tip that is as high above the plate as this share of its height over its flat has it on the plate."""
_DRIVE_RAD: Final = 0.018
_DRIVEN_ACTIONS: Final = 7
_BACK_SHARE: Final = 0.5
"""A corner that is caught is pushed back by this share of the push on its way out."""
_RIGHT_RAD: Final = radians(1.2)
"""A leaning corner may be wedged: standing up by so much an action frees it, a pull alone does not."""
_CLEAR_M: Final = 0.3e-3
_LONGEST_PUSH: Final = 40
_STAND_RAD: Final = radians(1.0)
_UPRIGHT_RAD: Final = radians(0.1)


class _Act(Enum):
    LEAN = "lean"
    PUSH = "push"
    STAND = "stand"
    INSERT = "insert"
    WITHDRAW = "withdraw"


class CornerFirst(FixedPolicy):
    """Leans over a corner, pushes it at both walls until nothing turns it, stands up, inserts; else the next corner.

    Pressed flat, nothing shows a peg's yaw against the hole's. One corner in the hole, pushed at both walls, does. A
    keyed peg's flat counts as its one corner: the arcs at its ends are the walls that centre it, and itself turns it.

    Args:
        options: Corners, lean and push.

    Raises:
        ConfigurationError: The peg has neither corners nor a flat.
    """

    def __init__(self, options: SpatialOptions) -> None:
        super().__init__()
        flat = options.flat_deg > 0.0
        if options.corners < 3 and not flat:
            raise ConfigurationError("task.options.corners", options.corners, f"3 or more for the policy {NAME}")
        self._options, self._flat = options, flat
        self._half_rad = radians(options.flat_deg) if flat else pi / int(options.corners)
        self._inside_m, self._radius_m = options.inside_mm * 1e-3, options.corner_mm * 1e-3
        height_m = self._radius_m * sin(radians(options.lean_deg))
        self._on_plate_m, self._caught_m, self._held_m = _ON_PLATE_M - height_m, _CAUGHT_M, 0.0
        if flat:
            self._held_m = max(height_m - _FLAT_M, _HANGS_M)
            self._on_plate_m, self._caught_m = -_FLAT_ON_PLATE * height_m, -self._held_m - _HANGS_M
        self._lean_rad, self._push_N = radians(options.lean_deg), 2.0 * options.push_N * cos(self._half_rad)

    @override
    def begin_trial(self, trial: int, rng: np.random.Generator) -> None:
        super().begin_trial(trial, rng)
        self._begin_corner(0)

    def _begin_corner(self, corner: int) -> None:
        self._corner, self._stage, self._left = corner, _Act.LEAN, 0
        # The neighbours of the first corner on both sides, and so on: 0, -1, 1, -2, 2 ...
        place = -(corner + 1) // 2 if corner % 2 else corner // 2
        self._heading_rad = 0.0 if self._flat else (2 * place + 1) * self._half_rad
        self._aside_m = place * _ASIDE_M if self._flat else 0.0
        self._quiet = self._pushed = self._leaned = 0
        self._lead_m, self._driven, self._drove = (0.0, 0.0), 0, False

    @override
    def choose(self, observation: Observation) -> Decision:
        """The next action of the stage."""
        lean = hypot(*observation.turn_rad[:2])
        if self._stage is _Act.LEAN and self._leaned and not self._left:
            self._stage = _Act.PUSH
        elif self._stage is _Act.PUSH:
            self._judge_push(observation)
        elif self._stage in (_Act.INSERT, _Act.WITHDRAW):
            # The insertion came to nothing.
            self._stage = _Act.WITHDRAW
            if observation.depth_m < -self._radius_m * sin(lean) - _CLEAR_M:
                self._begin_corner(self._corner + 1)
        if self._stage is _Act.STAND and lean < _UPRIGHT_RAD:
            self._stage = _Act.INSERT
            if observation.depth_m < 0.5 * _CAUGHT_M:
                self._stage = _Act.WITHDRAW
        displacement_m, spatial = (0.0, 0.0), Spatial(Law.INSERT)
        if self._stage is _Act.LEAN:
            displacement_m, spatial = self._leaning(observation)
        elif self._stage is _Act.PUSH:
            spatial = replace(self._pushing(observation, 0.0), rise_m=self._held_m)
            displacement_m = self._lead_m
            if self._driven:
                self._driven -= 1
                yaw_rad = self._drive_rad if self._driven >= _DRIVEN_ACTIONS else -self._drive_rad
                spatial = replace(spatial, turn_rad=(0.0, 0.0, yaw_rad))
        elif self._stage is _Act.WITHDRAW:
            back_N = -_BACK_SHARE * self._push_N if lean > _UPRIGHT_RAD else 0.0
            c, s = cos(self._heading_rad), sin(self._heading_rad)
            upright = min(1.0, _RIGHT_RAD / max(lean, _RIGHT_RAD))
            x, y, _ = observation.turn_rad
            spatial = Spatial(Law.WITHDRAW, 0.0, (-x * upright, -y * upright, 0.0), (back_N * c, back_N * s))
        elif self._stage is _Act.STAND:
            spatial = self._pushing(observation, min(1.0, _STAND_RAD / lean))
        return Decision(Action(self._stage.value, displacement_m, spatial), None, NAME, (float(self._corner),))

    def _judge_push(self, observation: Observation) -> None:
        self._pushed += 1
        (x, y, _), heading = observation.force_N, self._heading_rad + observation.turn_rad[2]
        along = [-x * cos(heading + side) - y * sin(heading + side) for side in (-self._half_rad, self._half_rad)]
        # What both walls give along the normal of each: apart, though their normals are not at right angles.
        mixed = cos(2.0 * self._half_rad)
        walls = [(one - mixed * other) / (1.0 - mixed * mixed) for one, other in (along, along[::-1])]
        c, s = cos(heading), sin(heading)
        self._lead_m = (_LEAD_M * c, _LEAD_M * s) if max(walls) < _FREE_N else (0.0, 0.0)
        quiet = min(walls) > _WALL_N and abs(observation.torque_Nm[2]) < _QUIET_NM
        self._quiet = self._quiet + 1 if quiet else 0
        if caught := observation.depth_m > self._caught_m:
            # Once it is in, only what it feels may turn it.
            self._driven = 0
        if self._quiet >= _QUIET_ACTIONS and caught:
            self._stage = _Act.STAND
        elif self._quiet >= _QUIET_ACTIONS and not self._drove:
            # Wedged: on in the direction in which it turned so far, then to the other side.
            self._driven, self._drove = 2 * _DRIVEN_ACTIONS, True
            self._drive_rad = copysign(_DRIVE_RAD, observation.turn_rad[2])
        elif (
            (self._quiet >= _QUIET_ACTIONS and not self._driven)
            or self._pushed == _LONGEST_PUSH
            or (self._pushed > 2 and observation.depth_m < self._on_plate_m)
        ):
            self._stage = _Act.WITHDRAW

    def _leaning(self, observation: Observation) -> tuple[tuple[float, float], Spatial]:
        """Up, and in equal parts over the corner and to the lean."""
        (x, y, _), (lean_x, lean_y, yaw) = observation.reference_m, observation.turn_rad
        c, s, rise_m = cos(self._heading_rad), sin(self._heading_rad), 0.0
        if not self._leaned:
            change_rad = hypot(s * self._lean_rad - lean_x, -c * self._lean_rad - lean_y)
            self._left, rise_m = ceil(change_rad / _LEAN_RAD), max(_RISE_M + observation.depth_m, 0.0)
            if hypot(*observation.force_N[:2]) > _CAUGHT_N:
                self._leaned += 1
                return (0.0, 0.0), Spatial(Law.LIFT, rise_m)
        left = self._left
        self._left, self._leaned = left - 1, self._leaned + 1
        turn = (s * self._lean_rad - lean_x) / left, (-c * self._lean_rad - lean_y) / left, -yaw / left
        inside_m, aside_m = self._inside_m, self._aside_m
        displacement_m = (-inside_m * c - aside_m * s - x) / left, (-inside_m * s + aside_m * c - y) / left
        return displacement_m, Spatial(Law.LIFT, rise_m, turn)

    def _pushing(self, observation: Observation, upright: float) -> Spatial:
        """At both walls, standing up by this share of the lean; the corner stays in its place."""
        lean_x, lean_y, yaw = observation.turn_rad
        c, s = cos(self._heading_rad + yaw), sin(self._heading_rad + yaw)
        turn = -upright * lean_x, -upright * lean_y, 0.0
        push = self._push_N * c, self._push_N * s
        return Spatial(Law.PUSH, 0.0, turn, push, (self._radius_m * c, self._radius_m * s))
