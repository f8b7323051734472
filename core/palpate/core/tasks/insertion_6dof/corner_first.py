"""For pegs with corners or a flat: one goes in first, pushed into its place in the hole, which turns the tool right."""

from dataclasses import replace
from enum import Enum
from math import copysign, hypot, radians, sin
from typing import Final

import numpy as np
from typing_extensions import override

from palpate.core.errors import ConfigurationError
from palpate.core.perception import Situations
from palpate.core.policy import Action, Decision, FixedPolicy, Law, Observation, Spatial
from palpate.core.tasks.insertion_6dof.corner import UPRIGHT_RAD, Corner
from palpate.core.tasks.insertion_6dof.options import SpatialOptions

NAME: Final = "corner-first"
ON_PLATE_M: Final = Situations.plate_m
"""A leaning tip that is lower by no more than this than one whose corner stands on the plate is not in the hole."""
WALL_N: Final = Situations.wall_N
QUIET_NM: Final = Situations.quiet_Nm
QUIET_ACTIONS: Final = 2
"""So many actions in a row both walls have to carry, and nothing to turn the tool."""
CAUGHT_M: Final = Situations.caught_m
"""A tip that is less deep below the plate hangs on a wall though both of them carry."""
HANGS_M: Final = 0.15e-3
"""One that is let down to a height and is higher by more hangs on an edge."""
DRIVE_RAD: Final = 0.018
DRIVEN_ACTIONS: Final = 7
LONGEST_PUSH: Final = 40
STAND_RAD: Final = radians(1.0)
_SUNK_M: Final = 1e-3
"""A tool that is so deep and all but upright was inserted and got stuck: once more, and then it is withdrawn."""


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
        if options.corners < 3 and not options.flat_deg:
            raise ConfigurationError("task.options.corners", options.corners, f"3 or more for the policy {NAME}")
        self._corner = Corner(options)
        height_m, down_m = self._corner.radius_m * sin(self._corner.lean_rad), self._corner.down_m
        self._on_plate_m, self._caught_m = 0.5 * down_m - height_m, down_m - height_m - HANGS_M

    @override
    def begin_trial(self, trial: int, rng: np.random.Generator) -> None:
        super().begin_trial(trial, rng)
        self._begin_corner(0)

    def _begin_corner(self, corner: int) -> None:
        self._corner.take(corner)
        self._stage, self._quiet, self._pushed, self._driven, self._drove = _Act.LEAN, 0, 0, 0, False

    @override
    def choose(self, observation: Observation) -> Decision:
        """The next action of the stage."""
        corner, lean = self._corner, hypot(*observation.turn_rad[:2])
        if self._stage is _Act.LEAN and corner.over:
            self._stage = _Act.PUSH
        elif self._stage is _Act.PUSH:
            self._judge_push(observation)
        elif self._stage in (_Act.INSERT, _Act.WITHDRAW):
            # The insertion came to nothing.
            self._stage = _Act.WITHDRAW
            if corner.clear(observation):
                self._begin_corner(corner.number + 1)
        stuck = lean < STAND_RAD and observation.depth_m > _SUNK_M
        if self._stage is _Act.STAND and (stuck or lean < UPRIGHT_RAD):
            self._stage = _Act.INSERT
            if observation.depth_m < 0.5 * CAUGHT_M:
                self._stage = _Act.WITHDRAW
        displacement_m, spatial = (0.0, 0.0), Spatial(Law.INSERT)
        if self._stage is _Act.LEAN:
            displacement_m, spatial = corner.leaning(observation)
        elif self._stage is _Act.PUSH:
            displacement_m = corner.lead_m
            spatial = corner.pushing(observation, 0.0)
            if self._driven:
                self._driven -= 1
                yaw_rad = self._drive_rad if self._driven >= DRIVEN_ACTIONS else -self._drive_rad
                spatial = replace(spatial, turn_rad=(0.0, 0.0, yaw_rad))
        elif self._stage is _Act.WITHDRAW:
            spatial = corner.withdrawing(observation)
        elif self._stage is _Act.STAND:
            spatial = corner.pushing(observation, min(1.0, STAND_RAD / lean))
        return Decision(Action(self._stage.value, displacement_m, spatial), None, NAME, (float(corner.number),))

    def _judge_push(self, observation: Observation) -> None:
        self._pushed += 1
        walls = self._corner.walls_N(observation)
        quiet = min(walls) > WALL_N and abs(observation.torque_Nm[2]) < QUIET_NM
        self._quiet = self._quiet + 1 if quiet else 0
        if caught := observation.depth_m > self._caught_m:
            # Once it is in, only what it feels may turn it.
            self._driven = 0
        if self._quiet >= QUIET_ACTIONS and caught:
            self._stage = _Act.STAND
        elif self._quiet >= QUIET_ACTIONS and not self._drove:
            # Wedged: on in the direction in which it turned so far, then to the other side.
            self._driven, self._drove = 2 * DRIVEN_ACTIONS, True
            self._drive_rad = copysign(DRIVE_RAD, observation.turn_rad[2])
        elif (
            (self._quiet >= QUIET_ACTIONS and not self._driven)
            or self._pushed == LONGEST_PUSH
            or self._corner.passed(observation)
            or (self._pushed > 2 and observation.depth_m < self._on_plate_m)
        ):
            self._stage = _Act.WITHDRAW
