"""Is the force sensor alive while the tool slides? Only so far may it go without a sign of it."""

import enum
from collections import deque
from math import hypot, inf, sqrt
from typing import Final

import numpy as np

from palpate.core.ports import CONTROL_RATE_HZ, PERIOD_S, Vector3
from palpate.core.tasks.contact.axial_check import HIGHEST_SHARE, LOWEST_SHARE


class UnevenHeave:
    """Strokes up and down, each as long as is drawn.

    Args:
        speed_m_s: Of each.
        strokes: Their lengths in ticks, of which one is drawn for each.
        heave_m: No further from where it began.
    """

    def __init__(self, speed_m_s: float, strokes: tuple[int, ...] = (2, 3, 4), heave_m: float = 3e-4) -> None:
        self._speed_m_s, self._strokes, self._heave_m = speed_m_s, strokes, heave_m

    def begin_trial(self, rng: np.random.Generator) -> None:
        """A trial begins, whose strokes are drawn from this."""
        self._rng = rng

    def begin(self) -> None:
        """The heave begins here, upwards."""
        self._left, self._velocity_m_s, self._heaved_m = 0, self._speed_m_s, 0.0

    def velocity_m_s(self) -> float:
        """Velocity along the tool axis for this tick."""
        if not self._left:
            self._velocity_m_s = -self._velocity_m_s
            tick_m = self._velocity_m_s * PERIOD_S
            fits = [ticks for ticks in self._strokes if abs(self._heaved_m + ticks * tick_m) <= self._heave_m]
            fits = fits or [self._strokes[0]]
            self._left = fits[int(self._rng.integers(len(fits)))]
        self._left -= 1
        self._heaved_m += self._velocity_m_s * PERIOD_S
        return self._velocity_m_s


FREE_WAY_M: Final = 1.3e-3
"""Travel without a sign of life after which the tool stops for a check, if nothing speaks against the sensor before. A
peg that caught on something meanwhile has bent the gripper by no more than that."""
_HEAVE_M: Final = 2.5e-4
"""The tool heaves by so much up and down from where the pressing law leads it, at most."""
_HALF_PERIOD_TICKS: Final = 5
_STROKES: Final = (3, 4, 5, 6, 7)
"""Shorter ones show less of the spring, longer ones have more in common with what was recorded in others."""
_FARTHER: Final = 1.4
"""An uneven heave goes so many times as far as an even one, or only short strokes would fit."""
_LOOKS: Final = 2
"""So many that were answered tell how late the force is."""
_LATEST_TICKS: Final = 6
"""The force may be so many ticks behind the command; later samples are stale to a supervisor, as it comes."""
_FEWEST: Final = 8
"""Samples below which nothing is concluded."""
_DEVIATIONS: Final = 3.0
"""The share has to be so many of its own standard deviations above none. Sliding is rough: what the force does besides
following the flange is measured with it. A dead sensor with a noise of 0.3 N passes by chance on one of a hundred such
ways; one that is noisier than its facts say is found by its noise."""
_SOONEST, _PAST = 8, 96
"""A recording is as long or longer, in samples, and so many are remembered to find it by."""
_AGAIN: Final = 0.1
"""A force that comes again leaves so much less of itself than what follows the heave. Of 3120 honest answers two left
less than 0.15 and none less than 0.1."""
_FEWEST_IN_AIR: Final = 14
_DEVIATIONS_IN_AIR: Final = 5.0
"""Inertia has no stiffness that is known beforehand: with these a dead sensor passes by chance in one second of four
hundred."""


class _Answer(enum.Enum):
    ALIVE = "alive"
    WRONG = "wrong"
    NONE = "none"


# Members of an enumeration are looked up more slowly.
_ALIVE, _WRONG, _NONE = _Answer.ALIVE, _Answer.WRONG, _Answer.NONE


class SignOfLife:
    """Holds the axial force against the axial motion of a tool that heaves a little while it slides.

    Between flange and peg lies the gripper's spring. While the peg bears on the plate, the force follows the flange
    with the spring's stiffness, wherever it slides; a sensor that is held, dead, noisy or wrongly scaled gives another
    number. This is the lift of :class:`~palpate.core.tasks.contact.axial_check.AxialCheck`, made in motion.

    A force that does not follow demands a check. Where the check finds the sensor sound, servos or samples are later
    than a heave can show; for the rest of the trial only a way without a sign demands another.

    Args:
        swing_N: Force that comes and goes with a heave of a tool that is borne.
        in_air: The tool may be in free air. By its inertia it follows the flange there too: with no share that is
            known beforehand, but it does.
        uneven: It heaves by strokes of a length that is drawn for each, so that what was recorded in one heave does not
            follow the next, and the force may not be much earlier or later than when it followed first.
    """

    def __init__(
        self,
        stiffness_N_per_m: float,
        swing_N: float,
        speed_m_s: float,
        *,
        in_air: bool = False,
        uneven: bool = False,
    ) -> None:
        self._stiffness, self._in_air = stiffness_N_per_m, in_air
        # Inertia pushes where the flange turns upwards, a spring where it comes down; late enough, each does both.
        self._fewest, self._deviations, self._sign = (
            (_FEWEST_IN_AIR, _DEVIATIONS_IN_AIR, -1.0) if in_air else (_FEWEST, _DEVIATIONS, 1.0)
        )
        heave_m = min(_HEAVE_M, swing_N / stiffness_N_per_m)
        self._speed_m_s = min(2.0 * heave_m * CONTROL_RATE_HZ / _HALF_PERIOD_TICKS, speed_m_s)
        self._uneven = UnevenHeave(self._speed_m_s, _STROKES, _FARTHER * heave_m) if uneven else None

    def begin(self, rng: np.random.Generator | None = None) -> None:
        """A trial begins, whose uneven strokes are drawn from this."""
        if self._uneven is not None and rng is not None:
            self._uneven.begin_trial(rng)
        self._forget_lag()
        # Each force, the depths that it may follow by lag, and what these count from.
        self._past: deque[tuple[float, tuple[float, ...], float]] = deque(maxlen=_PAST)
        self._place: tuple[float, float] | None = None
        self.travel_m = 0.0
        self._accused = self._late = False
        self.resume()

    def resume(self) -> None:
        """The slide begins, here or anew."""
        self._commanded_m: deque[float] = deque(maxlen=_LATEST_TICKS + 1)
        self._begin_heave()

    def _begin_heave(self) -> None:
        self._ticks = 0
        if self._uneven is not None:
            self._uneven.begin()
        self._restart()

    def heave_m_s(self) -> float:
        """Velocity along the tool axis to be added to that of the pressing law in this tick."""
        if self._uneven is not None:
            return self._uneven.velocity_m_s()
        self._ticks += 1
        # The first stroke is half as long, so that it heaves about where it began.
        up = (self._ticks + _HALF_PERIOD_TICKS // 2) // _HALF_PERIOD_TICKS % 2
        return -self._speed_m_s if up else self._speed_m_s

    def watch(self, force_z_N: float, new: bool, reference_m: Vector3) -> None:
        """A tick of a tool that presses on the plate.

        Args:
            force_z_N: Tared force along the tool axis, negative while pressing.
            reference_m: Commanded tip, task frame.
        """
        place, self._place = self._place, reference_m[:2]
        if place is not None:
            self.travel_m += hypot(reference_m[0] - place[0], reference_m[1] - place[1])
        self.follow(reference_m[2])
        if not new or len(self._commanded_m) <= _LATEST_TICKS:
            return
        self._count += 1
        depths = tuple(self._depths)
        self._waiting.append((force_z_N, depths))
        self._past.append((force_z_N, depths, self._origin_m * self._stiffness))
        if self._count < self._fewest:
            return
        self._add_up()
        answer = self._answer()
        if answer is _ALIVE:
            self.travel_m, self._accused = 0.0, False
            self._restart()
        elif answer is _WRONG and not self._late:
            self._accused = True
            self.demand_check()

    def follow(self, commanded_m: float) -> None:
        """A tick, be it of a check too: where the tip is commanded to along the tool axis.

        A slide that goes on after a check is judged by the commands of before as well. Without these a fast tool would
        have gone the free way before it can be judged at all, and each check would be followed by another.
        """
        self._commanded_m.appendleft(commanded_m)
        self._depths.appendleft((commanded_m - self._origin_m) * self._stiffness)

    def proved(self) -> None:
        """The sensor has answered to a check: travel counts from now on, and what it showed before does not."""
        self.travel_m = 0.0
        self._late = self._late or self._accused
        self._forget_lag()
        self._begin_heave()

    def demand_check(self) -> None:
        """A check is due for another reason."""
        self.travel_m = inf

    @property
    def due(self) -> bool:
        """Whether the tool has gone as far as it may without a sign of life."""
        return self.travel_m > FREE_WAY_M

    def _add_up(self) -> None:
        """Take the samples that wait into the sums: several at once, for alone each takes twice as long."""
        waiting = self._waiting
        for force, _ in waiting:
            self._force += force
            self._force_square += force * force
        for lag, (total, square, product) in enumerate(self._sums):
            for force, depths in waiting:
                depth = depths[lag]
                total += depth
                square += depth * depth
                product += depth * force
            self._sums[lag] = total, square, product
        waiting.clear()

    def _answer(self) -> _Answer:
        """What the force does with the motion, by the lag at which it follows best."""
        count, force, sign = self._count, self._force, self._sign
        follows, best, everywhere = -inf, 0, [0.0] * len(self._sums)
        for lag, (depth, square, product) in enumerate(self._sums):
            square -= depth * depth / count
            if square > 0.0:
                product = sign * (product - depth * force / count)
                everywhere[lag] = follows_here = -product / sqrt(square)
                if follows_here > follows and lag in self._lags:
                    follows, share, spread, best = follows_here, -product / square, square, lag
        if follows == -inf:
            return _NONE
        left = max(self._force_square - force * force / count - follows * follows, 0.0)
        error = self._deviations * sqrt(left / (spread * (count - 2)))
        if self._in_air:
            return _ALIVE if share > error else _NONE
        if share > error and LOWEST_SHARE <= share <= HIGHEST_SHARE:
            if self._uneven is not None:
                if self._comes_again(best, share, follows * follows):
                    return _WRONG
                self._learn_lag(everywhere)
            return _ALIVE
        if LOWEST_SHARE <= share + error and share - error <= HIGHEST_SHARE:
            return _NONE
        # A force that comes late has not had the time to answer before the heave is seen at the longest lag, too.
        spreads = [square - depth * depth / count for depth, square, _ in self._sums]
        return _WRONG if min(spreads) > 0.5 * max(spreads) else _NONE

    def _comes_again(self, lag: int, share: float, explained: float) -> bool:
        """Whether the force of this look is what it was some time before, though the heave is another one.

        Args:
            explained: Square sum of what seems to follow the heave; that of two heaves' difference is fourfold at most.
        """
        past, count = list(self._past), self._count
        now, most = past[-count:], 4.0 * _AGAIN * explained
        for first in range(len(past) - count - _SOONEST, -1, -1):
            again = total = squares = 0.0
            for (force, depths, origin), (old, at, counted) in zip(now, past[first : first + count], strict=True):
                again += (force - old) ** 2
                if again > most:
                    break
                left = force - old + share * (depths[lag] + origin - at[lag] - counted)
                total, squares = total + left, squares + left * left
            else:
                if again < _AGAIN * (squares - total * total / count):
                    return True
        return False

    def _forget_lag(self) -> None:
        self._lags, self._looks = range(_LATEST_TICKS + 1), 0
        self._followed = [0.0] * len(self._lags)

    def _learn_lag(self, follows: list[float]) -> None:
        """Servos and sensor are as late as ever: after two looks they are not asked at other lags."""
        self._looks += 1
        self._followed = list(map(float.__add__, self._followed, follows))
        if self._looks >= _LOOKS:
            lag = self._followed.index(max(self._followed))
            self._lags = range(lag - 1, lag + 2)

    def _restart(self) -> None:
        self._count, self._force, self._force_square = 0, 0.0, 0.0
        self._origin_m = origin_m = self._commanded_m[0] if self._commanded_m else 0.0
        depths = [(commanded_m - origin_m) * self._stiffness for commanded_m in self._commanded_m]
        self._depths = deque(depths, maxlen=_LATEST_TICKS + 1)
        # Each force, and by lag the depths that it may follow as if the spring bore them.
        self._waiting: list[tuple[float, tuple[float, ...]]] = []
        self._sums = [(0.0, 0.0, 0.0)] * (_LATEST_TICKS + 1)
