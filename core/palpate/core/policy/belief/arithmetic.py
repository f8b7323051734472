"""Array exponential and logarithm, with bit-identical results on every processor.

numpy's functions use vector units that round differently on different machines, and a belief that differs in a single
bit may select another action. Sums, products, square roots and scaling by powers of two are rounded the same everywhere
(IEEE 754), so these functions use nothing else. Their errors, below 2e-7, are negligible compared with contact
noise.
"""

from dataclasses import dataclass
from math import factorial, log, sqrt
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
"""Array in double precision, or in single precision for values over the grid."""


@dataclass(frozen=True, slots=True)
class _Format:
    """Constants for a floating-point format; ``ln2`` is in two parts, of which the first has few bits."""

    whole: np.dtype[np.signedinteger[Any]]
    mantissa_bits: int
    ln2: tuple[float, float]
    least: float
    terms: int

    @property
    def rounding(self) -> float:
        """Return the constant whose addition rounds a number to an integer in the lowest bits of the mantissa."""
        return 1.5 * 2.0**self.mantissa_bits


_FORMATS: Final = {
    np.dtype(np.float64): _Format(
        np.dtype(np.int64), 52, (0.693147180369123816490, 1.90821492927058770002e-10), -700.0, 7
    ),
    np.dtype(np.float32): _Format(np.dtype(np.int32), 23, (0.693359375, -2.12194440e-4), -60.0, 5),
}


def exponential(x: Floats) -> Floats:
    """Return e raised to each element; elements below -700 (-60 in single precision) are clipped.

    Elements must not exceed 700 (60 in single precision).
    """
    by = _FORMATS[x.dtype]
    high, low = by.ln2
    rest = np.maximum(x, by.least)
    rounded = rest * (1.0 / log(2.0)) + by.rounding
    powers = rounded - by.rounding
    rest = rest - powers * high - powers * low
    series = np.full_like(rest, 1.0 / factorial(by.terms))
    for k in range(by.terms - 1, -1, -1):
        series = series * rest + 1.0 / factorial(k)
    # Multiply by the power of two through the bits of the exponent, which is exact.
    scaled = series.view(by.whole) + (rounded.view(by.whole) << by.mantissa_bits)
    result: Floats = scaled.view(x.dtype)
    return result


def logarithm(x: Floats) -> Floats:
    """Return the natural logarithm of each element; all must exceed 1e-300 (1e-37 in single precision)."""
    by = _FORMATS[x.dtype]
    high, low = by.ln2
    # Powers of two that leave mantissas between sqrt(0.5) and sqrt(2).
    root_half = int(np.array(sqrt(0.5), x.dtype).view(by.whole))
    whole = (x.view(by.whole) - root_half) >> by.mantissa_bits
    mantissa = (x.view(by.whole) - (whole << by.mantissa_bits)).view(x.dtype)
    powers = whole.astype(x.dtype)
    ratio = (mantissa - 1.0) / (mantissa + 1.0)
    square = ratio * ratio
    most = 2 * (by.terms // 2) + 3
    series = np.full_like(square, 2.0 / most)
    for k in range(most - 2, 0, -2):
        series = series * square + 2.0 / k
    result: Floats = powers * high + (series * ratio + powers * low)
    return result
