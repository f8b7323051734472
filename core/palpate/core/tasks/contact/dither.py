"""A dither with random half-periods, superimposed on the motion of a pressing tool."""

import numpy as np

from palpate.core.job import HALF_PERIOD, HALF_PERIOD_TICKS, PEAK
from palpate.core.ports import PERIOD_S


class Dither:
    """Back-and-forth motion, timed at random so that no recorded or delayed force matches it by chance.

    Args:
        amplitude_m: Maximum distance from the start; less if the speed limits it.
        speed_m_s: Maximum speed.
    """

    def __init__(self, amplitude_m: float, speed_m_s: float) -> None:
        self.amplitude_m, self._speed_m_s = amplitude_m, speed_m_s

    def usual_m(self, amplitude_m: float) -> float:
        """Return the distance covered in a half-period of mean length at a given amplitude."""
        return min(amplitude_m, 0.5 * self._speed_m_s * HALF_PERIOD * PERIOD_S / PEAK)

    def begin(self, rng: np.random.Generator) -> None:
        """Reset the state for a trial, with half-periods drawn from the given generator."""
        self._rng, self._side = rng, 1.0
        self._left = self._ticks = 0
        self._offset_m = self._distance_m = 0.0

    def velocity_m_s(self) -> float:
        """Return the velocity for the current tick."""
        if not self._left:
            self._side = -self._side
            self._ticks = self._left = int(self._rng.integers(*HALF_PERIOD_TICKS))
            most_m = self._speed_m_s * self._ticks * PERIOD_S / PEAK
            self._distance_m = min(max(self._side * self.amplitude_m - self._offset_m, -most_m), most_m)
        done, self._left = self._ticks - self._left, self._left - 1
        moved_m = self._distance_m * (_smooth((done + 1) / self._ticks) - _smooth(done / self._ticks))
        self._offset_m += moved_m
        return moved_m / PERIOD_S


def _smooth(share: float) -> float:
    return share * share * (3.0 - 2.0 * share)
