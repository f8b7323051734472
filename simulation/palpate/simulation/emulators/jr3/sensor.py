"""The emulated JR3 sensor: full scales, times and errors, and the low-pass filter of its firmware."""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Annotated, Final, TypeAlias

import numpy as np

from palpate.core.ports import Range, Settings

FULL_SCALE_COUNTS = 16384
"""Counts of a load of one full scale. FACT: comedi jr3_pci.h."""

LARGEST_COUNTS = 32767
"""Where the signed 16-bit reading saturates, about two full scales. FACT: comedi jr3_pci.h."""

WRIST_FULL_SCALES = (115, 111, 185, 56, 52, 61)
"""Fx, Fy, Fz in N and Mx, My, Mz in 0.1 N m. FACT: example of jr3-mbed-firmware-can can-plotter.py."""

ASSUMED_NOISE_SHARE = 0.0005
"""Standard deviation of the noise of an acquisition as a share of full scale. assumed: no data sheet says."""

_Scale: TypeAlias = Annotated[int, Range(1, 0xFFFF)]
_TENTHS: Final = (1.0, 1.0, 1.0, 10.0, 10.0, 10.0)
_MIRRORED: Final = (-1.0, 1.0, 1.0, -1.0, 1.0, 1.0)


@dataclass(frozen=True, slots=True)
class Jr3Config(Settings):
    """One sensor with its board."""

    full_scales: tuple[_Scale, _Scale, _Scale, _Scale, _Scale, _Scale] = WRIST_FULL_SCALES
    """Fx, Fy, Fz in N, then Mx, My, Mz in 0.1 N m; unsigned 16-bit each."""
    boot_ns: Annotated[int, Range(0)] = 2_000_000_000
    """Time from power to the first look at the wire, ns. FACT: jr3-mbed-firmware-can main.cpp."""
    eeprom_ns: Annotated[int, Range(0)] = 32_896_000
    """Time to read the sensor's 256 calibration bytes, ns. CALC: one byte in each acquisition."""
    shortest_period_ns: Annotated[int, Range(1)] = 222_000
    """Fastest the wire carries samples, ns; a shorter period asked for is stretched to it. CALC: two CAN frames of 111
    bits at 1 Mbit/s."""
    left_handed: bool = True
    """Whether the axes are left-handed, so that Fx and Mx change sign. FACT: yarp-devices Jr3Pci."""
    connected: bool = True
    """Whether a sensor is plugged into the board at power-up."""
    noise_share: Annotated[float, Range(0.0)] = 0.0
    """Standard deviation of white noise on each acquisition, as a share of full scale."""

    def counts(self, wrench: Iterable[float]) -> list[float]:
        """Turn a true wrench into six counts along the sensor's axes, neither rounded nor saturated.

        Args:
            wrench: Fx, Fy, Fz in N and Mx, My, Mz in N m, in right-handed axes.
        """
        axes = zip(wrench, _TENTHS, self.full_scales, strict=True)
        scaled = [load * tenths * FULL_SCALE_COUNTS / full_scale for load, tenths, full_scale in axes]
        return [count * sign for count, sign in zip(scaled, _MIRRORED, strict=True)] if self.left_handed else scaled


ACQUISITION_PERIOD_ns = 128_500
"""Time between complete six-axis acquisitions: 128.5 us, 7782 a second. FACT: jr3-mbed-firmware Jr3Controller."""

UNFILTERED = 0
"""Cut-off that switches the filter off. FACT: jr3-mbed-firmware Jr3Controller.cpp."""


def smoothing_factor(cut_off_cHz: int) -> float:
    """Weight of a new acquisition for a cut-off frequency, above 0 and at most 1.

    FACT (jr3-mbed-firmware Jr3Controller.cpp): Ts / (Ts + 1 / (2 pi fc)), and 1 without a filter.
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
    """

    def __init__(self, generator: np.random.Generator) -> None:
        self._generator = generator
        self.alpha = 1.0
        """Weight of a new acquisition."""
        self.value = [0.0] * 6
        """State of the six axes, counts."""

    def tune(self, cut_off_cHz: int) -> None:
        """Change the cut-off (hundredths of a hertz; 0: unfiltered) and keep the state."""
        self.alpha = smoothing_factor(cut_off_cHz)

    def restart(self) -> None:
        """Start again from zero on all axes."""
        self.value = [0.0] * 6

    def hold(self, counts: Iterable[float], acquisitions: int, noise_counts: float) -> None:
        """Take the same input a number of times.

        Args:
            counts: Input of the six axes, counts.
            acquisitions: How often it was acquired, at least once.
            noise_counts: Standard deviation of white noise on each acquisition, counts.
        """
        keep = 1.0 - self.alpha
        left = keep**acquisitions
        self.value = [count + (value - count) * left for count, value in zip(counts, self.value, strict=True)]
        if noise_counts > 0.0:
            variance = self.alpha**2 * (1.0 - left**2) / (1.0 - keep**2)
            spread, draws = noise_counts * math.sqrt(variance), self._generator.standard_normal(6).tolist()
            self.value = [value + spread * draw for value, draw in zip(self.value, draws, strict=True)]
