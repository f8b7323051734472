"""Does the force answer a heave? By the tool's inertia in air, by friction and the spring where it touches."""

from __future__ import annotations

from collections import deque
from typing import Final

from palpate.core.ports import CONTROL_RATE_HZ

_MOST: Final = 96
"""Samples of a look at most; a noise of 0.3 N takes 30 to 50, by how the tare happened to show it."""
_SQUARE: Final = 16.0
"""What the heave explains has to be so many times the noise's square."""
_ROOM: Final = 1.25
_NOISE_SHARE: Final = 2.0
"""What is left may be so much more than the noise's square, which was measured with few samples, and a share of what is
explained, by one part alone and by three: encoders count in steps, and a tool that touches slips."""
_LEFT_ALONE: Final = 0.1
_LEFT: Final = 0.25
_LEAST_GAIN, _MOST_GAIN = 0.5, 1.6
"""Of the inertia, or the spring, that is known. A scaled force has another, and so has a heave that fits by chance."""
_FRICTION_N_S_PER_M: Final = 30.0
"""Steeper is the friction of no wall; it is a unit only."""
_BACKWARDS: Final = -0.3
"""No part may act the wrong way round, but for what noise does."""


class HeaveAnswer:
    """Fits the newest forces by what a tool that moves like this would give.

    Places are the encoders', at the time of the force, so no servo has to be known. In air the inertia has to explain
    the force alone; where the tool is borne, the spring; where it slips, inertia, friction and spring together, each
    the right way round. What follows another heave, as a recording does, is not explained, nor is mere noise.

    Args:
        mass_kg: Of all that the force sensor carries.
        stiffness_N_per_m: Of the gripper, along the tool axis.
    """

    def __init__(self, mass_kg: float, stiffness_N_per_m: float) -> None:
        self._mass, self._stiffness = mass_kg * CONTROL_RATE_HZ * CONTROL_RATE_HZ, stiffness_N_per_m
        self._viscous = _FRICTION_N_S_PER_M * CONTROL_RATE_HZ
        self._depths_m: deque[float] = deque(maxlen=3)
        self.begin()

    def begin(self) -> None:
        """A heave begins: what was felt before is no answer to it."""
        self._from_m: float | None = None
        # Sums from the beginning on: those of any number of samples are a difference.
        self._sums: deque[tuple[float, ...]] = deque(((0.0,) * 14,), maxlen=_MOST + 1)

    def add(self, depth_m: float, force_N: float) -> None:
        """A new sample: force along the tool axis, and where the encoders had the tip then."""
        self._depths_m.append(depth_m)
        if len(self._depths_m) < 3:
            return
        if self._from_m is None:
            self._from_m = depth_m
        before_m, last_m, _ = self._depths_m
        a, v = -self._mass * (depth_m - 2.0 * last_m + before_m), self._viscous * (last_m - depth_m)
        s, f = self._stiffness * (self._from_m - depth_m), force_N
        new = a, v, s, f, a * a, a * v, a * s, a * f, v * v, v * s, v * f, s * s, s * f, f * f
        self._sums.append(tuple(map(float.__add__, self._sums[-1], new)))

    def follows(self, fewest: int, noise_N: float) -> bool | None:
        """Whether the force follows the heave over the newest samples; None where these are too few to tell.

        Args:
            fewest: So many samples, or more where the sensor is noisy.
        """
        sums, least = self._sums, _SQUARE * noise_N * noise_N
        newest, count = sums[-1], fewest
        while count < len(sums) and newest[4] - sums[-1 - count][4] < _ROOM * least:
            count += 1
        if count >= len(sums):
            return None
        a, v, s, f, aa, av, as_, af, vv, vs, vf, ss, sf, ff = map(float.__sub__, newest, sums[-1 - count])
        aa, av, as_, af = aa - a * a / count, av - a * v / count, as_ - a * s / count, af - a * f / count
        vv, vs, vf = vv - v * v / count, vs - v * s / count, vf - v * f / count
        ss, sf, ff = ss - s * s / count, sf - s * f / count, ff - f * f / count
        if aa <= 0.0 or ss <= 0.0:
            return False
        noise, gain = _NOISE_SHARE * noise_N * noise_N, af / aa
        for share, explained in ((gain, gain * af), (sf / ss, sf * sf / ss)):
            left = ff - explained
            known = _LEAST_GAIN < share < _MOST_GAIN and explained > least
            if known and left < noise * (count - 2) + _LEFT_ALONE * explained:
                return True
        explained = gain * af
        # Least squares by elimination.
        av_, as__ = av / aa, as_ / aa
        vv, vs, vf = vv - av_ * av, vs - av_ * as_, vf - av_ * af
        if vv <= 0.0:
            return False
        vs_ = vs / vv
        ss, sf = ss - as__ * as_ - vs_ * vs, sf - as__ * af - vs_ * vf
        if ss <= 0.0:
            return False
        spring = sf / ss
        friction = vf / vv - vs_ * spring
        inertia = gain - av_ * friction - as__ * spring
        explained += vf * vf / vv + sf * spring
        return (
            min(inertia, friction, spring) > _BACKWARDS
            and max(inertia, spring) < _MOST_GAIN
            and explained > max(least, _LEAST_GAIN * _LEAST_GAIN * aa)
            and ff - explained < noise * (count - 4) + _LEFT * explained
        )
