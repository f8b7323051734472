"""Exponential and logarithm of arrays, the same bytes on every processor.

numpy's own use the vector units of the machine, and each kind rounds in its own way; a belief that differs in its last
bit would choose another action one day. Sums, products, square roots and scaling by powers of two are rounded the same
everywhere (IEEE 754), so these use nothing else. Their errors, below 2e-7, are nothing beside a touch's noise.
"""

from __future__ import annotations

from math import factorial, log, sqrt
from typing import Final

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

_LN2: Final = log(2.0)
_LN2_HIGH: Final = 0.693147180369123816490  # its first 32 bits: times a small whole number it is exact
_LN2_LOW: Final = 1.90821492927058770002e-10
_TAYLOR: Final = tuple(1.0 / factorial(k) for k in range(7, -1, -1))
_LEAST: Final = -700.0  # below, nothing is left that a float can hold
_ROOT_HALF: Final = sqrt(0.5)
_ATANH: Final = tuple(2.0 / k for k in range(9, 0, -2))


def exponential(x: Floats) -> Floats:
    """E to the power of each element; what is below -700 counts as that."""
    x = np.maximum(x, _LEAST)
    powers = np.rint(x * (1.0 / _LN2))
    rest = (x - powers * _LN2_HIGH) - powers * _LN2_LOW
    series = np.full_like(rest, _TAYLOR[0])
    for term in _TAYLOR[1:]:
        series *= rest
        series += term
    scaled: Floats = np.ldexp(series, powers.astype(np.int32))
    return scaled


def logarithm(x: Floats) -> Floats:
    """Natural logarithm of each element; all have to be above 0."""
    mantissa, powers = np.frexp(x)
    small = mantissa < _ROOT_HALF
    mantissa = np.where(small, 2.0 * mantissa, mantissa)
    powers = powers - small
    ratio = (mantissa - 1.0) / (mantissa + 1.0)
    square = ratio * ratio
    series = np.full_like(ratio, _ATANH[0])
    for term in _ATANH[1:]:
        series *= square
        series += term
    # Taking the high part times a whole number first keeps its bits.
    return powers * _LN2_HIGH + (ratio * series + powers * _LN2_LOW)
