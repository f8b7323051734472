"""Exponential and logarithm of arrays, the same bytes on every processor.

numpy's own use the vector units of the machine, and each kind rounds in its own way; a belief that differs in its last
bit would choose another action one day. Sums, products, square roots and scaling by powers of two are rounded the same
everywhere (IEEE 754), so these use nothing else. Their errors, below 2e-7, are nothing beside a touch's noise.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import factorial, log, sqrt
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
"""Doubles; of what is kept of places, singles where these say so."""


@dataclass(frozen=True, slots=True)
class _Format:
    """How floats of one size are reckoned with; all but the sizes as arrays, which numpy need not make at each call.

    Attributes:
        ln2_high: The first bits of it: times a small whole number it is exact.
        least: What is below leaves nothing that counts.
        rounding: Added, it leaves a whole number, in the last bits of the mantissa.
        taylor: Factors of the powers of the exponential, the highest first.
        atanh: Factors of the odd powers of twice the area tangent, the highest first.
    """

    bits: np.dtype[np.signedinteger[Any]]
    per_ln2: Floats
    ln2_high: Floats
    ln2_low: Floats
    least: Floats
    rounding: Floats
    mantissa_bits: np.ndarray
    root_half_bits: np.ndarray
    one: Floats
    taylor: tuple[Floats, ...]
    atanh: tuple[Floats, ...]

    @classmethod
    def of(
        cls, size: type[np.float64 | np.float32], mantissa_bits: int, ln2: tuple[float, float], least: float, terms: int
    ) -> _Format:
        """That of floats of this size, with an exponential of so many terms."""
        root_half_bits = _bits_of(np.array(sqrt(0.5), size))
        return cls(
            root_half_bits.dtype,
            np.array(1.0 / log(2.0), size),
            np.array(ln2[0], size),
            np.array(ln2[1], size),
            np.array(least, size),
            np.array(1.5 * 2.0**mantissa_bits, size),
            np.array(mantissa_bits, root_half_bits.dtype),
            root_half_bits,
            np.array(1.0, size),
            tuple(np.array(1.0 / factorial(k), size) for k in range(terms, -1, -1)),
            tuple(np.array(2.0 / k, size) for k in range(2 * (terms // 2) + 3, 0, -2)),
        )


def _bits_of(x: Floats) -> np.ndarray:
    """The same memory as whole numbers."""
    bits: np.ndarray = x.view(f"i{x.itemsize}")
    return bits


_FORMATS: Final = {
    np.dtype(np.float64): _Format.of(np.float64, 52, (0.693147180369123816490, 1.90821492927058770002e-10), -700.0, 7),
    np.dtype(np.float32): _Format.of(np.float32, 23, (0.693359375, -2.12194440e-4), -60.0, 5),
}


def exponential(x: Floats) -> Floats:
    """E to the power of each element; what is below -700, in single precision -60, counts as that.

    None may be as far above.
    """
    by = _FORMATS[x.dtype]
    rest = np.maximum(x, by.least)
    rounded = rest * by.per_ln2
    rounded += by.rounding
    powers = rounded - by.rounding
    rest -= powers * by.ln2_high
    powers *= by.ln2_low
    rest -= powers
    series: Floats = by.taylor[0] * rest
    series += by.taylor[1]
    for term in by.taylor[2:]:
        series *= rest
        series += term
    # Times two to the power, by the bits of the exponent: exact, and sooner than numpy's own scaling.
    exponents = rounded.view(by.bits)
    exponents <<= by.mantissa_bits
    bits = series.view(by.bits)
    bits += exponents
    return series


def logarithm(x: Floats) -> Floats:
    """Natural logarithm of each element; all have to be above 1e-300, in single precision 1e-37."""
    by = _FORMATS[x.dtype]
    bits = x.view(by.bits)
    # Powers of two that leave mantissas between the root of a half and twice that.
    whole = bits - by.root_half_bits
    whole >>= by.mantissa_bits
    powers: Floats = whole.astype(x.dtype)
    whole <<= by.mantissa_bits
    mantissa: Floats = np.subtract(bits, whole, out=whole).view(x.dtype)
    ratio = mantissa - by.one
    mantissa += by.one
    ratio /= mantissa
    square = ratio * ratio
    series = by.atanh[0] * square
    series += by.atanh[1]
    for term in by.atanh[2:]:
        series *= square
        series += term
    series *= ratio
    series += powers * by.ln2_low
    # Taking the high part times a whole number first keeps its bits.
    powers *= by.ln2_high
    powers += series
    return powers
