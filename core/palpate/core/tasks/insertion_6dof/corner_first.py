"""A policy for pegs with corners or a flat, which first pushes a corner into place in the hole to align the yaw."""

from enum import Enum
from math import copysign, hypot
from typing import Final

import numpy as np
from typing_extensions import override

from palpate.core.errors import ConfigurationError
from palpate.core.policy import Action, ControllerKind, Decision, FixedPolicy, Observation, Spatial
from palpate.core.tasks.insertion_6dof.corner import UPRIGHT_RAD, Corner
from palpate.core.tasks.insertion_6dof.options import SpatialOptions

NAME: Final = "corner-first"
QUIET_ACTIONS: Final = 2
"""Number of consecutive actions in which both walls must carry load without torque."""
DRIVEN_ACTIONS: Final = 7
LONGEST_WITHDRAWAL: Final = 20
"""Number of actions after which insertion is tried again if the tool is still in the hole."""
STAND_SHARE: Final = 0.2
"""Turn towards upright per action, as a fraction of the tilt."""
_STUCK_SHARE: Final = 0.62
"""Depth, divided by a tilted corner's depth, at which an almost upright tool counts as stuck; it is inserted again,
then withdrawn."""


class _Act(Enum):
    TILT = "tilt"
    PUSH = "push"
    STAND = "stand"
    INSERT = "insert"
    WITHDRAW = "withdraw"


class CornerFirst(FixedPolicy):
    """Policy that pushes a corner against both walls until no torque remains, then inserts or tries another corner.

    A peg pressed flat does not reveal its yaw relative to the hole. A corner in the hole that is pushed against both
    walls does. A keyed peg's flat is used as its only corner: the arcs at its ends are the walls that centre it,
    and the flat itself turns it.

    Args:
        options: Options for corners, tilt and push.

    Raises:
        ConfigurationError: The peg has neither corners nor a flat.
    """

    def __init__(self, options: SpatialOptions) -> None:
        super().__init__()
        if options.corners < 3 and not options.flat_deg:
            raise ConfigurationError("task.options.corners", options.corners, f"3 or more for the policy {NAME}")
        self._corner = Corner(options)
        self._stand_rad = STAND_SHARE * self._corner.tilt_rad
        self._stuck_m = _STUCK_SHARE * self._corner.down_m

    @override
    def begin_trial(self, trial: int, rng: np.random.Generator) -> None:
        super().begin_trial(trial, rng)
        self._begin_corner(0)

    def _begin_corner(self, corner: int) -> None:
        self._corner.take(corner)
        self._withdrawn = 0
        self._stage, self._quiet, self._pushed, self._driven, self._drove = _Act.TILT, 0, 0, 0, False

    def choose(self, observation: Observation) -> Decision:
        """Return the next action for the current stage."""
        corner, tilt = self._corner, hypot(*observation.turn_rad[:2])
        if self._stage is _Act.TILT and corner.over(observation):
            self._stage = _Act.PUSH
        elif self._stage is _Act.PUSH:
            self._judge_push(observation)
        elif self._stage in (_Act.INSERT, _Act.WITHDRAW):
            # The insertion has failed.
            self._stage, self._withdrawn = _Act.WITHDRAW, self._withdrawn + 1
            if corner.clear(observation):
                self._begin_corner(corner.number + 1)
        stuck = tilt < self._stand_rad and observation.depth_m > self._stuck_m
        if self._withdrawn > LONGEST_WITHDRAWAL and stuck:
            self._stage, self._withdrawn = _Act.INSERT, 0
        if self._stage is _Act.STAND and (stuck or tilt < UPRIGHT_RAD):
            self._stage = _Act.INSERT
            if not corner.upright_in_hole(observation):
                self._stage = _Act.WITHDRAW
        displacement_m, spatial = (0.0, 0.0), Spatial(ControllerKind.INSERT)
        if self._stage is _Act.TILT:
            displacement_m, spatial = corner.tilting(observation)
        elif self._stage is _Act.PUSH:
            displacement_m = corner.lead_m
            if self._driven:
                self._driven -= 1
                side = self._side if self._driven >= DRIVEN_ACTIONS else -self._side
                spatial = corner.driving(observation, side)
            else:
                spatial = corner.pushing(observation, 0.0)
        elif self._stage is _Act.WITHDRAW:
            spatial = corner.withdrawing(observation)
        elif self._stage is _Act.STAND:
            spatial = corner.pushing(observation, min(1.0, self._stand_rad / tilt))
        return Decision(Action(self._stage.value, displacement_m, spatial), None, NAME, (float(corner.number),))

    def _judge_push(self, observation: Observation) -> None:
        self._pushed += 1
        _, corner, tip, wall, torque = self._corner.facts(observation)
        self._quiet = self._quiet + 1 if wall > 1.0 and abs(torque) < 1.0 else 0
        if wedged := tip > 1.0:
            # A seated corner turns only because of the forces on it.
            self._driven = 0
        if self._quiet >= QUIET_ACTIONS and (wedged or (self._drove and not self._driven)):
            self._stage = _Act.STAND
        elif self._quiet >= QUIET_ACTIONS and not self._drove:
            # Wedged: continue turning in the same direction, then turn to the other side.
            self._driven, self._drove = 2 * DRIVEN_ACTIONS, True
            self._side = copysign(1.0, observation.turn_rad[2])
        elif (
            (self._quiet >= QUIET_ACTIONS and not self._driven)
            or self._pushed == self._corner.longest_push
            or self._corner.passed(observation)
            or (self._pushed > 2 and corner < 1.0)
        ):
            self._stage = _Act.WITHDRAW
