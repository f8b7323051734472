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
_ONE: Final = 1023  # exponent of 1 as a float's bits hold it, behind so many bits of the mantissa:
_MANTISSA_BITS: Final = 52
_ROOT_HALF_BITS: Final = np.float64(sqrt(0.5)).view(np.int64)
_ATANH: Final = tuple(2.0 / k for k in range(9, 0, -2))


def exponential(x: Floats) -> Floats:
    """E to the power of each element; what is below -700 counts as that, and none may be above 700."""
    rest = np.maximum(x, _LEAST)
    powers = rest * (1.0 / _LN2)
    np.rint(powers, out=powers)
    rest -= powers * _LN2_HIGH
    rest -= powers * _LN2_LOW
    series = _TAYLOR[0] * rest
    series += _TAYLOR[1]
    for term in _TAYLOR[2:]:
        series *= rest
        series += term
    # Two to the power, by its bits: exact, and sooner than numpy's own scaling.
    bits = powers.astype(np.int64)
    bits += _ONE
    bits <<= _MANTISSA_BITS
    series *= bits.view(np.float64)
    return series


def logarithm(x: Floats) -> Floats:
    """Natural logarithm of each element; all have to be above 1e-300."""
    bits = np.array(x, dtype=np.float64).view(np.int64)
    # Powers of two that leave mantissas between the root of a half and twice that.
    whole = bits - _ROOT_HALF_BITS
    whole >>= _MANTISSA_BITS
    powers = whole.astype(np.float64)
    whole <<= _MANTISSA_BITS
    bits -= whole
    mantissa = bits.view(np.float64)
    ratio = mantissa - 1.0
    mantissa += 1.0
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
