"""The low-pass filter of the JR3 firmware: an exponential moving average over six axes."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

ACQUISITION_PERIOD_ns = 128_500
"""Time between complete six-axis acquisitions: 128.5 us, 7782 a second. FACT: jr3-mbed-firmware Jr3Controller."""

UNFILTERED = 0
"""Cut-off that switches the filter off. FACT: jr3-mbed-firmware Jr3Controller.cpp."""

Vector = npt.NDArray[np.float64]


def smoothing_factor(cut_off_cHz: int) -> float:
    """Weight of a new acquisition for a cut-off frequency.

    FACT (jr3-mbed-firmware Jr3Controller.cpp): Ts / (Ts + 1 / (2 pi fc)), and 1 without a filter.

    Args:
        cut_off_cHz: Cut-off in hundredths of a hertz; 0 switches the filter off.

    Returns:
        The factor, above 0 and at most 1.
    """
    if cut_off_cHz == UNFILTERED:
        return 1.0
    period_s = ACQUISITION_PERIOD_ns * 1e-9
    return period_s / (period_s + 1.0 / (2.0 * math.pi * cut_off_cHz * 0.01))


class MovingAverage:
    """Exponential moving average that takes many acquisitions of a constant input in one step.

    After k acquisitions of x the state y has become x + (y - x) (1 - alpha)^k (CALC). White noise on each
    acquisition adds a normal variable whose variance is the sum of the geometric series of the weights (CALC), so
    one draw an axis replaces k draws without changing the distribution.

    Args:
        generator: Source of the noise; untouched while the noise is zero.
    """

    def __init__(self, generator: np.random.Generator) -> None:
        self._generator = generator
        self._alpha = 1.0
        self.value: Vector = np.zeros(6)
        """State of the six axes, counts."""

    @property
    def alpha(self) -> float:
        """Weight of a new acquisition."""
        return self._alpha

    def tune(self, cut_off_cHz: int) -> None:
        """Change the cut-off (hundredths of a hertz; 0: unfiltered) and keep the state."""
        self._alpha = smoothing_factor(cut_off_cHz)

    def restart(self) -> None:
        """Start again from zero on all axes."""
        self.value = np.zeros(6)

    def hold(self, counts: Vector, acquisitions: int, noise_counts: float) -> None:
        """Take the same input a number of times.

        Args:
            counts: Input of the six axes, counts.
            acquisitions: How often it was acquired, at least once.
            noise_counts: Standard deviation of white noise on each acquisition, counts.
        """
        keep = 1.0 - self._alpha
        left = keep**acquisitions
        self.value = counts + (self.value - counts) * left
        if noise_counts > 0.0:
            variance = self._alpha**2 * (1.0 - left**2) / (1.0 - keep**2)
            self.value += noise_counts * math.sqrt(variance) * self._generator.standard_normal(6)
