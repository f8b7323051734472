"""Intervals for curves and points."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
import numpy.typing as npt

LEVEL: Final = 0.95

Array = npt.NDArray[np.float64]


def t_half_width(values: Array) -> Array:
    """Half the width of Student's t interval of the mean over the first axis, 95 %.

    Rather than the bootstrap, because seeds are few: three values resampled never leave the range of the three, and
    intervals made of that are far too narrow.

    Args:
        values: Independent values, (n, ...), n at least 2.

    Returns:
        Shape of one of them.
    """
    from scipy.stats import t

    count = len(values)
    if count < 2:
        raise ValueError("an interval needs at least two values")
    factor = float(t.ppf((1.0 + LEVEL) / 2.0, count - 1)) / count**0.5
    half: Array = factor * np.std(values, axis=0, ddof=1)
    return half


def mean_with_interval(values: Sequence[float]) -> tuple[float, float | None, float | None]:
    """Mean of independent values and Student's t interval; None twice where there is only one value.

    Times are never below zero, so the lower end is cut off there.
    """
    data = np.asarray(values, dtype=float)
    mean = float(data.mean())
    if len(data) < 2:
        return mean, None, None
    half = float(t_half_width(data))
    return mean, max(0.0, mean - half), mean + half
