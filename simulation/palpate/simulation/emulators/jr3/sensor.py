"""The emulated JR3 sensor: full-scale values, timing, and its firmware's low-pass filter."""

import math
from collections.abc import Iterable
from typing import Final

FULL_SCALE_COUNTS = 16384
"""Counts at full scale. FACT: comedi jr3_pci.h."""

LARGEST_COUNTS = 32767
"""Counts at which the signed 16-bit reading saturates, about twice the full scale. FACT: comedi jr3_pci.h."""

WRIST_FULL_SCALES = (115, 111, 185, 56, 52, 61)
"""Fx, Fy, Fz in N and Mx, My, Mz in 0.1 N m. FACT: example in jr3-mbed-firmware-can can-plotter.py."""

SHORTEST_PERIOD_ns = 222_000
"""Minimum sample period on the bus. Shorter requested periods are raised to it. CALC: two CAN frames of 111 bits at
1 Mbit/s."""

ACQUISITION_PERIOD_ns = 128_500
"""Time between complete six-axis acquisitions: 128.5 us, 7782 per second. FACT: jr3-mbed-firmware Jr3Controller."""

UNFILTERED = 0
"""Cut-off that disables the filter. FACT: jr3-mbed-firmware Jr3Controller.cpp."""

_TENTHS: Final = (1.0, 1.0, 1.0, 10.0, 10.0, 10.0)
_MIRRORED: Final = (-1.0, 1.0, 1.0, -1.0, 1.0, 1.0)
"""Signs for the sensor's left-handed axes. FACT: yarp-devices Jr3Pci."""


def counts_of(wrench: Iterable[float]) -> list[float]:
    """Return six counts, saturated but not rounded, for Fx Fy Fz in N and Mx My Mz in N m, in right-handed axes."""
    axes = zip(wrench, _TENTHS, _MIRRORED, WRIST_FULL_SCALES, strict=True)
    counts = [load * tenths * sign * FULL_SCALE_COUNTS / scale for load, tenths, sign, scale in axes]
    return [min(max(count, -LARGEST_COUNTS), LARGEST_COUNTS) for count in counts]


def smoothing_factor(cut_off_cHz: int) -> float:
    """Return an acquisition's weight, Ts / (Ts + 1 / (2 pi fc)), or 1 if unfiltered. FACT: jr3-mbed-firmware."""
    if cut_off_cHz == UNFILTERED:
        return 1.0
    period_s = ACQUISITION_PERIOD_ns * 1e-9
    return period_s / (period_s + 1.0 / (2.0 * math.pi * cut_off_cHz * 0.01))


def smoothed(value: Iterable[float], counts: Iterable[float], alpha: float, acquisitions: int) -> list[float]:
    """Return the moving average after k identical inputs x; starting from y, it is x + (y - x) (1 - alpha)^k (CALC)."""
    left = (1.0 - alpha) ** acquisitions
    return [count + (old - count) * left for count, old in zip(counts, value, strict=True)]
