"""Is the force sensor alive while the tool slides? Only so far may it go without a sign of it."""

from __future__ import annotations

import enum
from collections import deque
from math import hypot, inf, sqrt
from typing import Final

from palpate.core.insertion.axial_check import HIGHEST_SHARE, LOWEST_SHARE
from palpate.core.ports import CONTROL_RATE_HZ, Vector3

FREE_WAY_M: Final = 1.5e-3
"""Travel without a sign of life after which the tool stops for a check, if nothing speaks for a dead sensor before. A
peg that caught on something meanwhile has bent the gripper by no more than that."""
_HEAVE_M: Final = 2.5e-4
"""The tool heaves by so much up and down from where the pressing law leads it, at most."""
_HEAVE_SHARE: Final = 0.25
"""At most so much of the pressing force comes and goes with it."""
_HALF_PERIOD_TICKS: Final = 5
_LATEST_TICKS: Final = 3
"""The force may be so many ticks behind the command."""
_FEWEST: Final = 8
"""Samples below which nothing is concluded."""
_DEVIATIONS: Final = 3.5
"""The share has to be so many of its own standard deviations above none. Sliding is rough: what the force does besides
following the flange is measured with it."""


class _Answer(enum.Enum):
    ALIVE = "alive"
    DEAD = "dead"
    NONE = "none"


class SignOfLife:
    """Holds the axial force against the axial motion of a tool that heaves a little while it slides.

    Between flange and peg lies the gripper's spring. While the peg bears on the plate, the force follows the flange
    with the spring's stiffness, wherever it slides; a sensor that is held, dead, noisy or wrongly scaled gives another
    number. This is the lift of :class:`~palpate.core.insertion.axial_check.AxialCheck`, made in motion.

    Args:
        stiffness_N_per_m: Axial stiffness of the gripper.
        press_N: Force with which the tool presses.
    """

    def __init__(self, stiffness_N_per_m: float, press_N: float) -> None:
        self._stiffness = stiffness_N_per_m
        heave_m = min(_HEAVE_M, _HEAVE_SHARE * press_N / stiffness_N_per_m)
        self._speed_m_s = 2.0 * heave_m * CONTROL_RATE_HZ / _HALF_PERIOD_TICKS
        self.begin()

    def begin(self) -> None:
        """A trial begins."""
        self._place: tuple[float, float] | None = None
        self.travel_m = 0.0
        self.resume()

    def resume(self) -> None:
        """The slide begins, here or anew."""
        self._ticks = 0
        self._commanded_m: deque[float] = deque(maxlen=_LATEST_TICKS + 1)
        self._restart()

    def heave_m_s(self) -> float:
        """Velocity along the tool axis to be added to that of the pressing law in this tick."""
        self._ticks += 1
        # The first quarter and the last one are half as long, so that it heaves about where it began.
        up = (self._ticks + _HALF_PERIOD_TICKS // 2) // _HALF_PERIOD_TICKS % 2
        return -self._speed_m_s if up else self._speed_m_s

    def watch(self, force_z_N: float, new: bool, reference_m: Vector3) -> None:
        """A tick of a tool that presses on the plate.

        Args:
            force_z_N: Tared force along the tool axis, negative while pressing.
            new: Whether this force is a new sample.
            reference_m: Commanded tip, task frame.
        """
        place, self._place = self._place, reference_m[:2]
        if place is not None:
            self.travel_m += hypot(reference_m[0] - place[0], reference_m[1] - place[1])
        self._commanded_m.appendleft(reference_m[2])
        if not new or len(self._commanded_m) <= _LATEST_TICKS:
            return
        self._count += 1
        self._force += force_z_N
        self._force_square += force_z_N * force_z_N
        for lag, sums in enumerate(self._sums):
            depth = (self._commanded_m[lag] - self._origin_m) * self._stiffness
            sums[0] += depth
            sums[1] += depth * depth
            sums[2] += depth * force_z_N
        if self._count < _FEWEST:
            return
        answers = [self._answer(sums) for sums in self._sums]
        if _Answer.ALIVE in answers:
            self.proved()
        elif all(answer is _Answer.DEAD for answer in answers):
            self.demand_check()

    def proved(self) -> None:
        """The sensor has answered, here or to a check: travel counts from now on."""
        self.travel_m = 0.0
        self._restart()

    def demand_check(self) -> None:
        """A check is due for another reason."""
        self.travel_m = inf

    @property
    def due(self) -> bool:
        """Whether the tool has gone as far as it may without a sign of life."""
        return self.travel_m > FREE_WAY_M

    def _answer(self, sums: list[float]) -> _Answer:
        """Whether the force follows the motion, by sums of the spring's force at one lag."""
        depth, square, product = sums
        count = self._count
        spread = square - depth * depth / count
        if spread <= 0.0:
            return _Answer.NONE
        share = -(product - depth * self._force / count) / spread
        left = max(self._force_square - self._force * self._force / count - share * share * spread, 0.0)
        error = _DEVIATIONS * sqrt(left / (spread * (count - 2)))
        if share > error and LOWEST_SHARE <= share <= HIGHEST_SHARE:
            return _Answer.ALIVE
        return _Answer.DEAD if share + error < LOWEST_SHARE else _Answer.NONE

    def _restart(self) -> None:
        self._count, self._force, self._force_square = 0, 0.0, 0.0
        self._origin_m = self._commanded_m[0] if self._commanded_m else 0.0
        self._sums = [[0.0, 0.0, 0.0] for _ in range(_LATEST_TICKS + 1)]
