"""The motions that move a peg's corner, or its flat, into the matching corner of the hole, and the forces there."""

from math import ceil, cos, hypot, inf, pi, radians, sin
from typing import Final

from palpate.core.perception import Situations
from palpate.core.policy import ControllerKind, Observation, Spatial
from palpate.core.tasks.insertion_6dof.options import SpatialOptions

_TILT_RAD: Final = radians(2.0)
"""Turn per action: 20 degrees/s. Slower arms take more actions."""
_STEP_M: Final = 1.8e-3
"""Step per action above the plate: 18 mm/s, below the usual speed in free space."""
_NEAR_M: Final = 0.5e-3
_ASIDE_SHARE: Final = 0.25
"""Lateral shift in later attempts with a flat, divided by the inside distance."""
_STOOD_SHARE: Final = 0.55
"""Fraction of the depth that a tool reaches when lowered, because compliance during the descent reduces its tilt."""
_SLIPS_SHARE: Final = 0.3
_WEDGED_SHARE: Final = 0.91
_SUNK_SHARE: Final = 0.15
"""Fractions of the depth that classify the tool. A shallower tilted corner is on the plate, and a deeper one is in its
corner of the hole. The same applies to an upright tool."""
_CLEARS_M: Final = 0.4e-3
"""Height at which a corner moves over the plate; depth is known to 0.15 mm, and a dither adds as much again."""
_WEDGED_N: Final = 1.5
"""Lateral force above which a tool is wedged on an edge and must first move straight up."""
_FREE_N: Final = 1.2
_LEAD_SHARE: Final = 1.0 / 60.0
"""Advance per action divided by the inside distance, while the force on each wall is below the friction limit."""
_LONGEST_PUSH: Final = 30
_SLOWEST_M: Final = 0.5e-3
"""Number of actions in the longest stationary push, and distance per action on the way there."""
_WALL_SHARE: Final = 0.5
"""Force on a loaded wall, divided by the push."""
_QUIET_SHARE: Final = 0.2
"""Torque divided by the push at the corner, below which the tool does not turn."""
_BACK_SHARE: Final = 0.5
"""Force that pushes a wedged corner back during withdrawal, divided by the push."""
_DRIVE_SHARE: Final = 1.0 / 3.0
"""Force, divided by the push, while a wedged corner is turned; it reduces the friction at its walls."""
_ACTION_S: Final = 0.1
_RIGHT_RAD: Final = radians(1.2)
"""Turn towards upright per action. It frees a tilted corner that is wedged; a pull alone does not."""
_CLEAR_M: Final = 0.3e-3
UPRIGHT_RAD: Final = radians(0.1)


class Corner:
    """A peg corner, and the tool actions for it.

    Depths are relative to the depth to which a tilted corner is lowered.

    Args:
        options: Options for corners, tilt and push; a peg without corners uses four points on its rim.

    Attributes:
        half_rad: Half the angle between two corners.
        tilted: Number of tilting actions so far.
        longest_push: Number of actions in a push without contact.
        lead_m: Tool advance in the next push, (2,), task frame.
    """

    def __init__(self, options: SpatialOptions) -> None:
        self._flat = bool(options.flat_deg)
        self.half_rad = radians(options.flat_deg) if self._flat else pi / int(options.corners or 4)
        self._inside_m, self.radius_m = options.inside_mm * 1e-3, options.corner_mm * 1e-3
        self._lead_m = _LEAD_SHARE * self._inside_m
        self.longest_push = _LONGEST_PUSH + ceil(self._inside_m / _SLOWEST_M)
        self.tilt_rad, self.push_N = radians(options.tilt_deg), options.push_N
        self._down_share = options.down_share * options.neighbour_height
        self._drive_rad = options.drive_Nm * options.push_yaw_rad_per_Nms * _ACTION_S
        self.take(0)

    def take(self, number: int) -> None:
        """Select a corner by its number in attempt order."""
        # The neighbours of the first corner, alternating between both sides: 0, -1, 1, -2, 2 ...
        place = -(number + 1) // 2 if number % 2 else number // 2
        self.number, self._heading_rad = number, 0.0 if self._flat else (2 * place + 1) * self.half_rad
        self._aside_m = place * _ASIDE_SHARE * self._inside_m if self._flat else 0.0
        self.tilted, self._way_m = 0, inf
        self.lead_m = (0.0, 0.0)

    @property
    def height_m(self) -> float:
        """Return the corner's distance below the tip of the tilted tool."""
        return self.radius_m * sin(self.tilt_rad)

    @property
    def down_m(self) -> float:
        """Return the depth to which the corner is lowered."""
        return self._down_share * self.height_m

    @property
    def _push(self) -> float:
        return 2.0 * self.push_N * cos(self.half_rad)

    def walls_N(self, observation: Observation) -> tuple[float, float]:
        """Return each wall's force along its normal, resolved for normals that are not orthogonal."""
        (x, y, _), heading = observation.force_N, self._heading_rad + observation.turn_rad[2]
        along = [-x * cos(heading + side) - y * sin(heading + side) for side in (-self.half_rad, self.half_rad)]
        mixed = cos(2.0 * self.half_rad)
        one, other = [(one - mixed * other) / (1.0 - mixed * mixed) for one, other in (along, along[::-1])]
        c, s = cos(heading), sin(heading)
        self.lead_m = (self._lead_m * c, self._lead_m * s) if max(one, other) < _FREE_N else (0.0, 0.0)
        return one, other

    def facts(self, observation: Observation) -> tuple[float, ...]:
        """Return the situation features, in the order of :data:`palpate.core.perception.FACTS`."""
        tilt_rad, depth_m, down_m = hypot(*observation.turn_rad[:2]), observation.depth_m, self.down_m
        corner_m = depth_m + self.radius_m * sin(tilt_rad)
        upright = tilt_rad < Situations.tilted * self.tilt_rad
        tip = depth_m / (_SUNK_SHARE * down_m) if upright else corner_m / (_WEDGED_SHARE * down_m)
        wall = min(self.walls_N(observation)) / (_WALL_SHARE * self.push_N)
        torque = observation.torque_Nm[2] / (_QUIET_SHARE * self.push_N * self.radius_m)
        return tilt_rad / self.tilt_rad, corner_m / (_SLIPS_SHARE * down_m), tip, wall, torque

    def upright_in_hole(self, observation: Observation) -> bool:
        """Return True if the upright tool is too deep to be on the plate."""
        return observation.depth_m > _SUNK_SHARE * self.down_m

    def clear(self, observation: Observation) -> bool:
        """Return True if the tilted tool is out of the hole."""
        return observation.depth_m < -self.radius_m * sin(hypot(*observation.turn_rad[:2])) - _CLEAR_M

    def passed(self, observation: Observation) -> bool:
        """Return True if the corner is as far past its nominal position as it was short of it when lowered."""
        x, y, _ = observation.reference_m
        return x * cos(self._heading_rad) + y * sin(self._heading_rad) > self._inside_m

    def over(self, observation: Observation) -> bool:
        """Return True if the tool is tilted over the corner, or has reached the edge of the area."""
        dx, dy, tilt_x, tilt_y = self._ahead(observation)
        way_m, before_m = hypot(dx, dy), self._way_m
        self._way_m = way_m
        # The edge of the area may be nearer than the target.
        there = way_m < _NEAR_M or way_m > before_m - _CLEAR_M
        return bool(self.tilted) and there and hypot(tilt_x, tilt_y) < UPRIGHT_RAD

    def _ahead(self, observation: Observation) -> tuple[float, float, float, float]:
        (x, y, _), (tilt_x, tilt_y, _) = observation.reference_m, observation.turn_rad
        c, s = cos(self._heading_rad), sin(self._heading_rad)
        # Only a flat, which is at heading 0, is also approached with a sideways shift.
        dx, dy = -self._inside_m * c - x, -self._inside_m * s + self._aside_m - y
        return dx, dy, s * self.tilt_rad - tilt_x, -c * self.tilt_rad - tilt_y

    def _left(self, observation: Observation) -> int:
        """Return the number of remaining actions until the tool is tilted over the corner."""
        dx, dy, tilt_x, tilt_y = self._ahead(observation)
        turns = (hypot(tilt_x, tilt_y) - UPRIGHT_RAD) / _TILT_RAD
        return max(ceil(turns), ceil((hypot(dx, dy) - _NEAR_M) / _STEP_M), 0)

    def tilting(self, observation: Observation) -> tuple[tuple[float, float], Spatial]:
        """Return the next action: first move up, then tilt in equal steps while moving over the corner."""
        self.tilted += 1
        # If the speed limit shortens the lift, the next actions complete it.
        rise_m = max(self.height_m + _CLEARS_M + observation.depth_m, 0.0)
        if self.tilted == 1 and hypot(*observation.force_N[:2]) > _WEDGED_N:
            return (0.0, 0.0), Spatial(ControllerKind.LIFT, rise_m)
        left = max(self._left(observation), 1)
        dx, dy, tilt_x, tilt_y = self._ahead(observation)
        turn = tilt_x / left, tilt_y / left, -observation.turn_rad[2] / left
        return (dx / left, dy / left), Spatial(ControllerKind.LIFT, rise_m, turn)

    def pushing(self, observation: Observation, upright: float) -> Spatial:
        """Push against both walls while turning upright by a fraction of the tilt; the corner stays in place."""
        tilt_x, tilt_y, yaw = observation.turn_rad
        c, s = cos(self._heading_rad + yaw), sin(self._heading_rad + yaw)
        turn = -upright * tilt_x, -upright * tilt_y, 0.0
        push = self._push * c, self._push * s
        down_m = self.down_m * (_STOOD_SHARE if upright else 1.0)
        # Keep the corner at this depth, and the tip at the height that corresponds to the tilt.
        rise_m = self.radius_m * sin((1.0 - upright) * hypot(tilt_x, tilt_y)) - down_m
        return Spatial(ControllerKind.PUSH, rise_m, turn, push, (self.radius_m * c, self.radius_m * s))

    def driving(self, observation: Observation, side: float) -> Spatial:
        """Turn a wedged corner to one side, 1 or -1, with the torque that overcomes its friction."""
        pushing = self.pushing(observation, 0.0)
        x, y = pushing.push_N
        push = x * _DRIVE_SHARE, y * _DRIVE_SHARE
        return Spatial(ControllerKind.PUSH, pushing.rise_m, (0.0, 0.0, side * self._drive_rad), push, pushing.pivot_m)

    def withdrawing(self, observation: Observation) -> Spatial:
        """Move out of the hole while turning upright."""
        tilt = hypot(*observation.turn_rad[:2])
        back_N = -_BACK_SHARE * self._push if tilt > UPRIGHT_RAD else 0.0
        c, s = cos(self._heading_rad), sin(self._heading_rad)
        upright = min(1.0, _RIGHT_RAD / max(tilt, _RIGHT_RAD))
        x, y, _ = observation.turn_rad
        return Spatial(ControllerKind.WITHDRAW, 0.0, (-x * upright, -y * upright, 0.0), (back_N * c, back_N * s))
