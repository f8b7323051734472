"""The motions that bring one corner of a peg, or its flat, into its place in the hole, and what is felt there."""

from math import ceil, cos, hypot, pi, radians, sin
from typing import Final

from palpate.core.policy import Law, Observation, Spatial
from palpate.core.tasks.insertion_6dof.options import SpatialOptions

_ASIDE_M: Final = 1.5e-3
"""There is one flat: it is tried again so far aside, on one side and the other."""
_STOOD_M: Final = 0.9e-3
"""A tool that is let down to a height stands no deeper: how it leans shows on the way down, which gives way to it."""
_RISE_M: Final = 2.2e-3
_CAUGHT_N: Final = 1.5
"""A tool that feels more across its axis is caught on an edge: straight up first."""
_FREE_N: Final = 1.2
_LEAD_M: Final = 0.1e-3
"""The tool is led on by so much an action while less than that force, friction's, is felt on each wall."""
_BACK_SHARE: Final = 0.5
"""A corner that is caught is pushed back by this share of the push on its way out."""
_RIGHT_RAD: Final = radians(1.2)
"""A leaning corner may be wedged: standing up by so much an action frees it, a pull alone does not."""
_CLEAR_M: Final = 0.3e-3
UPRIGHT_RAD: Final = radians(0.1)


class Corner:
    """One of a peg's corners, and what the tool does about it.

    Args:
        options: Corners, lean and push; of a peg without corners four places of its rim serve as such.

    Attributes:
        half_rad: Half the angle between two corners.
        leaned: Actions of the lean so far.
        lead_m: By so much the tool is led on at the next push, (2,), task frame.
    """

    def __init__(self, options: SpatialOptions) -> None:
        self._flat = bool(options.flat_deg)
        self.half_rad = radians(options.flat_deg) if self._flat else pi / int(options.corners or 4)
        self._inside_m, self.radius_m = options.inside_mm * 1e-3, options.corner_mm * 1e-3
        self.lean_rad, self.push_N = radians(options.lean_deg), options.push_N
        self._down_share, self._step_rad = options.down_share, radians(options.lean_step_deg)
        self.take(0)

    def take(self, number: int) -> None:
        """Turn to a corner, by its number in the order in which they are tried."""
        # The neighbours of the first corner on both sides, and so on: 0, -1, 1, -2, 2 ...
        place = -(number + 1) // 2 if number % 2 else number // 2
        self.number, self._heading_rad = number, 0.0 if self._flat else (2 * place + 1) * self.half_rad
        self._aside_m = place * _ASIDE_M if self._flat else 0.0
        self.leaned = self._left = 0
        self.lead_m = (0.0, 0.0)

    @property
    def over(self) -> bool:
        """Whether the tool leans over the corner, or was to."""
        return bool(self.leaned) and not self._left

    @property
    def down_m(self) -> float:
        """How deep it is let down until the tool stands."""
        return self._down_share * self.radius_m * sin(self.lean_rad)

    @property
    def _push(self) -> float:
        return 2.0 * self.push_N * cos(self.half_rad)

    def walls_N(self, observation: Observation) -> tuple[float, float]:
        """What both walls give along the normal of each: apart, though their normals are not at right angles."""
        (x, y, _), heading = observation.force_N, self._heading_rad + observation.turn_rad[2]
        along = [-x * cos(heading + side) - y * sin(heading + side) for side in (-self.half_rad, self.half_rad)]
        mixed = cos(2.0 * self.half_rad)
        one, other = [(one - mixed * other) / (1.0 - mixed * mixed) for one, other in (along, along[::-1])]
        c, s = cos(heading), sin(heading)
        self.lead_m = (_LEAD_M * c, _LEAD_M * s) if max(one, other) < _FREE_N else (0.0, 0.0)
        return one, other

    def clear(self, observation: Observation) -> bool:
        """Whether the leaning tool is out of the hole."""
        return observation.depth_m < -self.radius_m * sin(hypot(*observation.turn_rad[:2])) - _CLEAR_M

    def passed(self, observation: Observation) -> bool:
        """Whether a corner was pushed as far past its nominal place as it had come down inside it."""
        x, y, _ = observation.reference_m
        return x * cos(self._heading_rad) + y * sin(self._heading_rad) > self._inside_m

    def leaning(self, observation: Observation) -> tuple[tuple[float, float], Spatial]:
        """Up, and in equal parts over the corner and to the lean."""
        (x, y, _), (lean_x, lean_y, yaw) = observation.reference_m, observation.turn_rad
        c, s, rise_m = cos(self._heading_rad), sin(self._heading_rad), 0.0
        if not self.leaned:
            change_rad = hypot(s * self.lean_rad - lean_x, -c * self.lean_rad - lean_y)
            self._left, rise_m = ceil(change_rad / self._step_rad), max(_RISE_M + observation.depth_m, 0.0)
            if hypot(*observation.force_N[:2]) > _CAUGHT_N:
                self.leaned += 1
                return (0.0, 0.0), Spatial(Law.LIFT, rise_m)
        left = self._left
        self._left, self.leaned = left - 1, self.leaned + 1
        turn = (s * self.lean_rad - lean_x) / left, (-c * self.lean_rad - lean_y) / left, -yaw / left
        # Only a flat, which is at heading 0, is met aside as well.
        displacement_m = (-self._inside_m * c - x) / left, (-self._inside_m * s + self._aside_m - y) / left
        return displacement_m, Spatial(Law.LIFT, rise_m, turn)

    def pushing(self, observation: Observation, upright: float) -> Spatial:
        """At both walls, standing up by this share of the lean; the corner stays in its place."""
        lean_x, lean_y, yaw = observation.turn_rad
        c, s = cos(self._heading_rad + yaw), sin(self._heading_rad + yaw)
        turn = -upright * lean_x, -upright * lean_y, 0.0
        push = self._push * c, self._push * s
        down_m = min(self.down_m, _STOOD_M) if upright else self.down_m
        # Kept so deep, and the tip as high as that is while the tool leans so far.
        rise_m = self.radius_m * sin((1.0 - upright) * hypot(lean_x, lean_y)) - down_m
        return Spatial(Law.PUSH, rise_m, turn, push, (self.radius_m * c, self.radius_m * s))

    def withdrawing(self, observation: Observation) -> Spatial:
        """Out of the hole, standing up."""
        lean = hypot(*observation.turn_rad[:2])
        back_N = -_BACK_SHARE * self._push if lean > UPRIGHT_RAD else 0.0
        c, s = cos(self._heading_rad), sin(self._heading_rad)
        upright = min(1.0, _RIGHT_RAD / max(lean, _RIGHT_RAD))
        x, y, _ = observation.turn_rad
        return Spatial(Law.WITHDRAW, 0.0, (-x * upright, -y * upright, 0.0), (back_N * c, back_N * s))
