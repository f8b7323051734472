"""Does the force answer a heave? By the tool's inertia in air, by friction and the spring where it touches."""

from __future__ import annotations

from collections import deque
from math import inf
from operator import add, sub
from typing import Final

from palpate.core.ports import PERIOD_S

_MOST: Final = 192
"""Samples of a look at most; a noise of 0.3 N takes 30 to 90, by how the tare happened to show it."""
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
_BEHIND_S: Final = PERIOD_S
"""A force is so far behind the acceleration that it is due to: it is sampled over a tick, and the gripper yields."""
_KEPT: Final = 32
"""Places and forces that wait for each other; older ones are stale to a supervisor."""
_FEWEST_SHOWN: Final = 28
_SURELY_SHOWN: Final = 56
"""Of fewer samples the mean square is taken for more: long strokes, as they may be drawn, turn seldom."""
_LEAST_WEIGHT: Final = 0.5
"""Of a force in the middle between three places: with less of it there is none at their time."""


class HeaveAnswer:
    """Fits the newest forces by what a tool that moves like this would give.

    Places are the encoders', so no servo has to be known. Either sensor may be late, and may be slower than the other:
    three places tell the acceleration over the time that they span, and the force is weighed over that same time. The
    three are taken further apart where the encoders' steps would hide the acceleration.

    In air the inertia has to explain the force alone; where the tool is borne, the spring; where it slips, inertia,
    friction and spring together, each the right way round. What follows another heave, as a recording does, is not
    explained, nor is mere noise.

    Args:
        mass_kg: Of all that the force sensor carries.
        stiffness_N_per_m: Of the gripper, along the tool axis.
        apart_ticks: The three places are at least so far apart.

    Attributes:
        other_kg: What the sensor would carry, by the newest force of this trial that was all inertia, and another's.
    """

    def __init__(self, mass_kg: float, stiffness_N_per_m: float, apart_ticks: int) -> None:
        self._mass, self._stiffness, self._apart_ticks = mass_kg, stiffness_N_per_m, apart_ticks
        self._apart_s = (apart_ticks - 0.5) * PERIOD_S if apart_ticks > 1 else 0.0

    def begin_trial(self) -> None:
        """A trial begins, with other samples."""
        self.other_kg: float | None = None
        self._places: deque[tuple[float, float]] = deque(maxlen=_KEPT)
        self._forces: deque[tuple[float, float]] = deque(maxlen=_KEPT)

    def begin(self) -> None:
        """A heave begins: what was felt before is no answer to it."""
        self._from_m: float | None = None
        # Sums from the beginning on: those of any number of samples are a difference.
        self._sums: deque[tuple[float, ...]] = deque(((0.0,) * 16,), maxlen=_MOST + 1)

    def felt(self, time_s: float, force_N: float) -> None:
        """A new sample of the force along the tool axis."""
        self._forces.append((time_s, force_N))

    def moved(self, time_s: float, depth_m: float) -> None:
        """A new place of the tip by the encoders, along the tool axis."""
        if not self._places or time_s > self._places[-1][0]:
            self._places.append((time_s, depth_m))

    def paired(self, heaves: bool) -> bool:
        """Whether there are samples that have become a pair by what is new: at most one a call.

        Args:
            heaves: Whether it counts; else it is only passed over.
        """
        places, apart_s = self._places, self._apart_s
        if len(places) < 3 or not self._forces:
            return False
        (t0, x0), (t1, x1), (t2, x2) = places[0], places[1], places[2]
        quick_N: float | None = None
        if apart_s:
            quick_N = self._inertia_N(places[0], places[1], places[2])
            ahead = iter(places)
            t1, x1 = next((each for each in ahead if each[0] - t0 >= apart_s), (inf, 0.0))
            t2, x2 = next((each for each in ahead if each[0] - t1 >= apart_s), (inf, 0.0))
            if t2 == inf:
                return False
        rise_s, fall_s, middle_s = t1 - t0, t2 - t1, t1 + _BEHIND_S
        # The next force would count nothing any more.
        if self._forces[-1][0] < middle_s + fall_s - 1.02 * PERIOD_S:
            return False
        if not heaves:
            places.popleft()
            return False
        f, weights, squares = _weighed(self._forces, middle_s, rise_s, fall_s)
        # What the spring gives is weighed, too.
        now_m = _weighed(places, middle_s, rise_s, fall_s)[0] if apart_s else x1 + (x2 - x1) * _BEHIND_S / fall_s
        places.popleft()
        if weights < _LEAST_WEIGHT:
            return False
        if self._from_m is None:
            self._from_m = now_m
        a = self._inertia_N((t0, x0), (t1, x1), (t2, x2))
        v, s = _FRICTION_N_S_PER_M * (x1 - x2) / fall_s, self._stiffness * (self._from_m - now_m)
        shown = a * a if quick_N is None else quick_N * quick_N
        own = squares / weights**2
        new = a, v, s, f, a * a, a * v, a * s, a * f, v * v, v * s, v * f, s * s, s * f, f * f, own, shown
        self._sums.append(tuple(map(add, self._sums[-1], new)))
        return True

    def _inertia_N(self, first: tuple[float, float], middle: tuple[float, float], last: tuple[float, float]) -> float:
        """What the tool's mass gives by three places and their times."""
        (t0, x0), (t1, x1), (t2, x2) = first, middle, last
        rise_s, fall_s = t1 - t0, t2 - t1
        return 2.0 * self._mass * ((x1 - x2) / fall_s - (x0 - x1) / rise_s) / (rise_s + fall_s)

    @property
    def shown_N2(self) -> float | None:
        """Mean square of what the tool's mass gives by the encoders since the heave began; None for few samples."""
        first, newest, count = self._sums[0], self._sums[-1], len(self._sums) - 1
        if count < _FEWEST_SHOWN:
            return None
        return (newest[15] - first[15]) / count * max(_SURELY_SHOWN / count, 1.0)

    def follows(self, fewest: int, noise_N: float) -> bool | None:
        """Whether the force follows the heave over the newest samples; None where these are too few to tell.

        Args:
            fewest: So many samples, or more where the sensor is noisy.
        """
        sums, least = self._sums, _SQUARE * noise_N * noise_N
        # Those that overlap tell less each.
        newest, count = sums[-1], fewest * self._apart_ticks
        while count < len(sums) and newest[4] - sums[-1 - count][4] < _ROOM * least:
            count += 1
        if count >= len(sums):
            return None
        differences: map[float] = map(sub, newest, sums[-1 - count])
        a, v, s, f, aa, av, as_, af, vv, vs, vf, ss, sf, ff, squares, _ = differences
        aa, av, as_, af = aa - a * a / count, av - a * v / count, as_ - a * s / count, af - a * f / count
        vv, vs, vf = vv - v * v / count, vs - v * s / count, vf - v * f / count
        ss, sf, ff = ss - s * s / count, sf - s * f / count, ff - f * f / count
        if aa <= 0.0 or ss <= 0.0:
            return False
        # A weighed mean is less noisy than a force.
        noise, gain = _NOISE_SHARE * noise_N * noise_N * squares / count, af / aa
        explained = gain * af
        for share, shown in ((sf / ss, sf * sf / ss), (gain, explained)):
            known = _LEAST_GAIN < share < _MOST_GAIN and shown > least
            if known and ff - shown < noise * (count - 2) + _LEFT_ALONE * shown:
                return True
        alone = ff - explained < noise * (count - 2) + _LEFT_ALONE * explained
        if alone and explained > least and gain > 0.0 and not _LEAST_GAIN < gain < _MOST_GAIN:
            self.other_kg = gain * self._mass
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


def _weighed(
    samples: deque[tuple[float, float]], middle_s: float, rise_s: float, fall_s: float
) -> tuple[float, float, float]:
    """Mean of samples about a time, each less the further away it is; sums of their weights and of the squares."""
    total = weights = squares = 0.0
    for time_s, value in reversed(samples):
        away_s = time_s - middle_s
        weight = 1.0 - away_s / fall_s if away_s > 0.0 else 1.0 + away_s / rise_s
        if weight > 0.0:
            total, weights, squares = total + weight * value, weights + weight, squares + weight * weight
        elif away_s < 0.0:
            break
    return total / max(weights, _LEAST_WEIGHT), weights, squares
