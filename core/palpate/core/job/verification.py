"""Contact verification: the gripper's spring, the dither that bends it, and the window that reveals its stiffness.

All quantities use one consistent system of units, as in :mod:`palpate.core.job.derived`.
"""

from dataclasses import dataclass
from math import ceil, hypot, inf, sqrt
from typing import Final

from palpate.core.ports import PERIOD_S

HALF_PERIOD_TICKS: Final = (3, 8)
"""Range of half-periods, excluding the upper bound. Servos smooth out shorter half-periods, and longer ones differ too
little between trials."""
HALF_PERIOD: Final = 0.5 * (HALF_PERIOD_TICKS[0] + HALF_PERIOD_TICKS[1] - 1)
"""Mean half-period in ticks."""
PEAK: Final = 1.5
"""Ratio of peak to mean velocity in a half-period, s * s * (3 - 2 * s)."""
_FARTHEST: Final = 0.75
"""Amplitude divided by the travel in a mean half-period, if the speed limits it; random half-periods add up."""
DITHER_SHARE: Final = 0.3
"""Dither force amplitude, divided by the pressing force. Contact is maintained, and the roughness of sliding
friction, about a tenth of the pressing force, does not hide the response."""
_MOST_DITHER_SHARE: Final = 0.5
"""Maximum amplitude divided by the pressing force, for a noisy sensor; the rest of that force maintains contact."""
AXIAL: Final = (0.65, 1.5)
"""Accepted ratio of measured to nominal stiffness, known to about ten percent; half and double are outside it."""
_SMOOTHED: Final = 0.5
"""RMS dither force divided by its amplitude: 0.7 for a sine, reduced by the servos."""
DEVIATIONS_95: Final = 2.0
"""Half-width of a 95 % confidence interval, in standard deviations."""
NARROW: Final = 0.25
FAIR: Final = 0.5
"""Maximum interval half-widths, divided by the stiffness: NARROW for a result that ends the trial, FAIR to
continue. Both distinguish half and twice the stiffness."""
_FEWEST: Final = 18
"""Number of samples in the shortest window, three dither periods. Two periods would match by chance within a second."""
MOST_SAMPLES: Final = 56
"""Number of samples in the longest window, 0.4 s; a sensor that needs more is too noisy for this press."""
ACROSS: Final = (0.2, 1.5)
"""Accepted ratio of measured to nominal lateral stiffness. Peg tilt, friction along a wall and coarse encoders
lower it, to no less than 0.24 in trials without a fault. A sensor that shows a tenth of the force is outside."""
PUSH_SHARE: Final = 0.25
"""Gripper deflection from a push, divided by the budget, at which the push stops growing. Even if it grows by the same
amount again before it is measured, the deflection stays below the budget."""
ATTENUATED: Final = 0.7
"""Limit on the correction for attenuation; half the force then stays below the accepted stiffness."""


@dataclass(frozen=True)
class Spring:
    """The gripper's spring along one axis, and the accepted range of its measured stiffness.

    Attributes:
        damping_s: Damping divided by stiffness.
        rigid_kg: Mass between sensor and spring.
        lowest, highest: Bounds on the accepted measured stiffness, divided by the true stiffness.
    """

    stiffness_N_per_m: float
    damping_s: float
    rigid_kg: float
    lowest: float
    highest: float
    period_s: float = PERIOD_S

    def noise_N(self, noise_N: float, step_m: float) -> float:
        """Return the combined noise in force and positions."""
        return hypot(noise_N, self.stiffness_N_per_m * step_m, 2.4 * self.rigid_kg * step_m / self.period_s**2)

    def blur_N(self, step_m: float) -> float:
        """Return the standard deviation of the expected force due to position errors alone."""
        spring_N, inertia_N = self.stiffness_N_per_m * step_m, self.rigid_kg * step_m / self.period_s**2
        return sqrt(spring_N**2 * (1.0 + 0.5 * (self.damping_s / self.period_s) ** 2) + 6.0 * inertia_N**2)

    def least_dither_N(self, noise_N: float, step_m: float, half_width: float = NARROW) -> float:
        """Return the minimum dither amplitude that the longest window can verify, given the position errors."""
        least_N = _per_root_sample(self.noise_N(noise_N, step_m), half_width) / sqrt(MOST_SAMPLES - _FEWEST)
        return max(least_N, self.blur_N(step_m) * sqrt(ATTENUATED / (1.0 - ATTENUATED)) / _SMOOTHED)

    def dither_N(self, press_N: float, noise_N: float, step_m: float) -> float:
        """Return the dither amplitude for a pressing tool."""
        least_N = self.least_dither_N(noise_N, step_m)
        return min(max(DITHER_SHARE * press_N, least_N), _MOST_DITHER_SHARE * press_N)

    def samples(self, noise_N: float, dither_N: float, half_width: float = NARROW) -> int:
        """Return the number of samples in a window.

        Args:
            noise_N: Combined noise in force and positions.
            half_width: Required half-width of the confidence interval.
        """
        return _FEWEST + ceil((_per_root_sample(noise_N, half_width) / dither_N) ** 2)

    def window_s(self, noise_N: float, step_m: float, dither_N: float) -> float:
        """Return the shortest time to verify a contact; inf if position errors hide the response."""
        # Most windows show an accepted stiffness if the mean is midway between the lowest and the gripper's own.
        share = 0.5 * (self.lowest + 1.0) * ATTENUATED
        if _SMOOTHED * dither_N < self.blur_N(step_m) * sqrt(share / (1.0 - share)):
            return inf
        return self.samples(self.noise_N(noise_N, step_m), dither_N, FAIR) * self.period_s


def farthest_m(speed_m_s: float, period_s: float) -> float:
    """Return the dither amplitude reached at a given speed."""
    return _FARTHEST * speed_m_s * HALF_PERIOD * period_s / PEAK


def _per_root_sample(noise_N: float, half_width: float) -> float:
    """Return the dither amplitude times the square root of the sample count for an interval with a given half-width."""
    return DEVIATIONS_95 * noise_N / (_SMOOTHED * half_width)
