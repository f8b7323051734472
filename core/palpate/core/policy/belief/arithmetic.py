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

# As arrays, which numpy need not make of them at each call.
_PER_LN2: Final = np.array(1.0 / log(2.0))
_LN2_HIGH: Final = np.array(0.693147180369123816490)  # its first 32 bits: times a small whole number it is exact
_LN2_LOW: Final = np.array(1.90821492927058770002e-10)
_TAYLOR: Final = tuple(np.array(1.0 / factorial(k)) for k in range(7, -1, -1))
_LEAST: Final = np.array(-700.0)  # below, nothing is left that a float can hold
_ROUND: Final = np.array(1.5 * 2.0**52)  # added, it leaves a whole number, in the last bits of the mantissa
_MANTISSA_BITS: Final = np.array(52)
_ROOT_HALF_BITS: Final = np.array(sqrt(0.5)).view(np.int64)
_ONE: Final = np.array(1.0)
_ATANH: Final = tuple(np.array(2.0 / k) for k in range(9, 0, -2))


def exponential(x: Floats) -> Floats:
    """E to the power of each element; what is below -700 counts as that, and none may be above 700."""
    rest = np.maximum(x, _LEAST)
    rounded = rest * _PER_LN2
    rounded += _ROUND
    powers = rounded - _ROUND
    rest -= powers * _LN2_HIGH
    powers *= _LN2_LOW
    rest -= powers
    series: Floats = _TAYLOR[0] * rest
    series += _TAYLOR[1]
    for term in _TAYLOR[2:]:
        series *= rest
        series += term
    # Times two to the power, by the bits of the exponent: exact, and sooner than numpy's own scaling.
    exponents = rounded.view(np.int64)
    exponents <<= _MANTISSA_BITS
    bits = series.view(np.int64)
    bits += exponents
    return series


def logarithm(x: Floats) -> Floats:
    """Natural logarithm of each element; all have to be above 1e-300."""
    bits = np.asarray(x, dtype=np.float64).view(np.int64)
    # Powers of two that leave mantissas between the root of a half and twice that.
    whole = bits - _ROOT_HALF_BITS
    whole >>= _MANTISSA_BITS
    powers = whole.astype(np.float64)
    whole <<= _MANTISSA_BITS
    mantissa = np.subtract(bits, whole, out=whole).view(np.float64)
    ratio = mantissa - _ONE
    mantissa += _ONE
    ratio /= mantissa
    square = ratio * ratio
    series = _ATANH[0] * square
    series += _ATANH[1]
    for term in _ATANH[2:]:
        series *= square
        series += term
    series *= ratio
    series += powers * _LN2_LOW
    # Taking the high part times a whole number first keeps its bits.
    powers *= _LN2_HIGH
    powers += series
    return powers
