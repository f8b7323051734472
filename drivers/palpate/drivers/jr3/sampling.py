"""Convert readings to flagged samples."""

from collections import Counter
from math import pi
from typing import Final

from palpate.drivers.device import ForceSample
from palpate.drivers.jr3.messages import NEAR_SATURATION_COUNTS, FullScales, Reading, Signs

REPEATED: Final = "repeated readings"
RESTARTED: Final = "counters that began again"
_WRAP: Final = 0x10000
_SETTLED_TAUS: Final = 5.0
"""Number of time constants after which the filter counts as settled; 0.7 % of a step then remains (CALC)."""


def settling_ns(cutoff_cHz: int) -> int:
    """Return the time after which the filter is considered settled, in ns, or 0 without a filter.

    CALC: the filter is first-order (FACT, Jr3Controller.cpp of jr3-mbed-firmware), tau = 1/(2 pi cut-off); 0.4 s at
    2 Hz.
    """
    return round(_SETTLED_TAUS * 1e9 / (2.0 * pi * cutoff_cHz * 0.01)) if cutoff_cHz else 0


class Sampler:
    """Converter from readings to samples, numbered in order of arrival.

    Attributes:
        full_scales: The board's full-scale values, or None if not yet known; readings then yield no samples.
    """

    def __init__(self, cutoff_cHz: int, signs: Signs, errors: Counter[str]) -> None:
        self.full_scales: FullScales | None = None
        self.samples = self.last_new_ns = 0
        self._settling_ns, self._signs, self._errors = settling_ns(cutoff_cHz), signs, errors
        self._settled_at_ns = 0
        self._counter: int | None = None

    def started(self, now_ns: int) -> None:
        """Prepare for a new stream, in which the counter may have any value and the filter starts at 0."""
        self._counter = None
        self.last_new_ns, self._settled_at_ns = now_ns, now_ns + self._settling_ns

    def take(self, reading: Reading, now_ns: int) -> ForceSample | None:
        """Return the sample for a reading, or None if it is not new."""
        if self.full_scales is None:
            return None
        ahead = 1 if self._counter is None else (reading.counter - self._counter) % _WRAP
        if not ahead:
            self._errors[REPEATED] += 1
            return None
        if ahead >= _WRAP // 2:
            # The counter restarted at 0. After several seconds of silence it may also have wrapped, which is harmless.
            self._errors[RESTARTED] += 1
            self._settled_at_ns = now_ns + self._settling_ns
        self._counter, self.last_new_ns = reading.counter, now_ns
        self.samples += 1
        force_N, torque_Nm = self.full_scales.wrench(reading.counts, self._signs)
        return ForceSample(
            force_N,
            torque_Nm,
            self.samples,
            now_ns,
            saturated=max(map(abs, reading.counts)) > NEAR_SATURATION_COUNTS,
            settling=now_ns < self._settled_at_ns,
        )
