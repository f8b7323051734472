"""How late is too late, and what is told of it."""

from dataclasses import dataclass
from typing import Final, Self, TypeAlias

import numpy as np
import numpy.typing as npt

from palpate.adapters.config import RealTimeConfig
from palpate.adapters.hardware.real_time.attribution import Attribution, Cause


@dataclass(frozen=True, slots=True)
class Limits:
    """Thresholds, looked at in every tick; 0 stands for never.

    Attributes:
        warn_late_ns: A tick that begins later than this after its time is told.
        stop_late_ns: One that begins later than this ends the run.
        warn_core_ns: A tick in which the core took longer than this is told.
        warm_up_ticks: Ticks at the start to which nothing of this applies.
    """

    warn_late_ns: int = 0
    stop_late_ns: int = 0
    warn_core_ns: int = 0
    warm_up_ticks: int = 0

    @classmethod
    def of(cls, config: RealTimeConfig) -> Self:
        """The limits of a configuration."""
        late, stop, core = (round(ms * 1e6) for ms in (config.warn_late_ms, config.stop_late_ms, config.warn_core_ms))
        return cls(late, stop, core, config.warm_up_ticks)


@dataclass(frozen=True, slots=True)
class LateTick:
    """A tick that began too late.

    Attributes:
        tick: Counts the ticks that were timed, from 0.
        longest: What took longest in the tick before, or in that before a row of late ones; empty where none was timed.
    """

    tick: int
    time_ns: int
    late_ns: int
    attribution: Attribution
    longest: str = ""

    @property
    def blame(self) -> str:
        """The cause, and of our own work what took longest."""
        cause = self.attribution.cause
        return f"{cause.value}: {self.longest}" if cause is Cause.OWN_WORK and self.longest else cause.value

    def __str__(self) -> str:
        return (
            f"tick {self.tick} at {self.time_ns * 1e-9:.3f} s began {self.late_ns * 1e-6:.2f} ms late:"
            f" {self.blame} ({self.attribution})"
        )


@dataclass(frozen=True, slots=True)
class SlowCore:
    """A tick in which the core took too long.

    Attributes:
        tick: Counts the ticks that were timed, from 0.
    """

    tick: int
    core_ns: int

    def __str__(self) -> str:
        return f"tick {self.tick}: the core took {self.core_ns * 1e-6:.2f} ms"


Whole: TypeAlias = npt.NDArray[np.int64]

_STEPS: Final = 16
"""Bins per doubling: a time that is read back is off by at most 1/32."""
_BINS: Final = 60 * _STEPS


@dataclass(frozen=True, slots=True)
class LatenessSpread:
    """A distribution of times, in short. Quantiles are of a bin's middle, count, mean and maximum are exact.

    Attributes:
        p99_ns: 99 % are below.
        p999_ns: 99.9 % are below.
    """

    count: int
    mean_ns: float
    median_ns: float
    p99_ns: float
    p999_ns: float
    max_ns: int


class Histograms:
    """Distributions of several columns of times."""

    def __init__(self, columns: int) -> None:
        self._bins = np.zeros((columns, _BINS), np.int64)
        self._flat = self._bins.reshape(-1)
        self._count, self._sum, self._max = (np.zeros(columns, np.int64) for _ in range(3))
        self._offset = np.arange(columns, dtype=np.int64) * _BINS

    def add(self, times_ns: Whole, there: npt.NDArray[np.bool_]) -> None:
        """Take in times.

        Args:
            times_ns: One row per tick, one column per distribution, none negative.
            there: Which of them count, of the same shape.
        """
        np.add.at(self._flat, (bins_of(times_ns) + self._offset)[there], 1)
        kept = times_ns * there
        self._count += there.sum(axis=0)
        self._sum += kept.sum(axis=0)
        np.maximum(self._max, kept.max(axis=0, initial=0), out=self._max)

    def spread(self, column: int) -> LatenessSpread:
        """A column's distribution in short; all zero while it is empty."""
        count, longest = int(self._count[column]), int(self._max[column])
        if not count:
            return LatenessSpread(0, 0.0, 0.0, 0.0, 0.0, 0)
        below = np.cumsum(self._bins[column])
        ranks = [max(1, int(np.ceil(share * count))) for share in (0.5, 0.99, 0.999)]
        median, p99, p999 = (min(_middle_ns(int(np.searchsorted(below, rank))), float(longest)) for rank in ranks)
        return LatenessSpread(count, int(self._sum[column]) / count, median, p99, p999, longest)


def bins_of(times_ns: Whole) -> Whole:
    """The bin of each time: below 16 ns its own, above 16 to every doubling."""
    # A double has room for 53 bits exactly, 104 days in ns.
    exponent = np.frexp(times_ns.astype(np.float64))[1].astype(np.int64)
    octave = np.maximum(exponent - 4, 0)
    bins: Whole = np.where(octave > 0, octave * _STEPS + ((times_ns >> np.maximum(octave - 1, 0)) & 15), times_ns)
    return np.minimum(bins, _BINS - 1)


def _middle_ns(bin_number: int) -> float:
    octave, step = divmod(bin_number, _STEPS)
    if octave == 0:
        return float(step)
    width = 1 << (octave - 1)
    return (_STEPS + step) * width + 0.5 * (width - 1)
