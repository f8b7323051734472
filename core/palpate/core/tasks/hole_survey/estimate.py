"""Numbers with their uncertainty, from touches that were made several times."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import sqrt
from typing import Final

_OF_FEW: Final = {1: 12.706204736, 2: 4.302652730}
_EXPANSION: Final = (1.5895340533938225, 2.555849679507722, 2.8224986157396112, 2.372271230298562, 1.959963984540054)
"""The highest power first; the last one is of as many as you like."""


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
    # Cornish and Fisher's expansion in powers of 1 / freedom, within 0.13 % from 3 on.
    half_width, *terms = _EXPANSION
    for term in terms:
        half_width = half_width / freedom + term
    return half_width


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
