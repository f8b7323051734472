"""Numbers with their uncertainty, from touches that were made several times."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import sqrt
from typing import Final

_NORMAL: Final = 1.959963984540054
_OF_FEW: Final = {1: 12.706204736, 2: 4.302652730}


@dataclass(frozen=True, slots=True)
class Sized:
    """A number with the half width of its 95 % interval, mm."""

    mm: float
    within_mm: float

    def __str__(self) -> str:
        return f"{self.mm:.4f} +- {self.within_mm:.4f}"


def student_t(freedom: int) -> float:
    """Half width of a two-sided 95 % interval, in standard uncertainties of so many degrees of freedom."""
    if freedom in _OF_FEW:
        return _OF_FEW[freedom]
    # Cornish and Fisher's expansion, within 0.1 % from 3 on.
    z, n = _NORMAL, freedom
    z3, z5, z7, z9 = z**3, z**5, z**7, z**9
    return (
        z
        + (z3 + z) / (4 * n)
        + (5 * z5 + 16 * z3 + 3 * z) / (96 * n**2)
        + (3 * z7 + 19 * z5 + 17 * z3 - 15 * z) / (384 * n**3)
        + (79 * z9 + 776 * z7 + 1482 * z5 - 1920 * z3 - 945 * z) / (92160 * n**4)
    )


def mean_of(values_m: Sequence[float]) -> Sized:
    """The mean of two or more, by their own scatter."""
    mean, square = _moments(values_m)
    freedom = len(values_m) - 1
    return Sized(mean * 1e3, student_t(freedom) * sqrt(square / freedom / len(values_m)) * 1e3)


def difference_of(these_m: Sequence[float], those_m: Sequence[float]) -> Sized:
    """By how much the mean of these is above the mean of those, two or more each that scatter alike."""
    (mean, square), (base, base_square) = _moments(these_m), _moments(those_m)
    freedom = len(these_m) + len(those_m) - 2
    share = 1.0 / len(these_m) + 1.0 / len(those_m)
    sd_m = sqrt((square + base_square) / freedom * share)
    return Sized((mean - base) * 1e3, student_t(freedom) * sd_m * 1e3)


def _moments(values: Sequence[float]) -> tuple[float, float]:
    """Mean, and sum of the squared deviations from it."""
    mean = sum(values) / len(values)
    return mean, sum((value - mean) ** 2 for value in values)
