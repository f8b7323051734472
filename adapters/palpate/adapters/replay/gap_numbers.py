"""Robust least squares over trials: their equations, deviations, and the least of a cost."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, TypeAlias

import numpy as np
import numpy.typing as npt

Array: TypeAlias = npt.NDArray[np.float64]

_ROBUST: Final = 4.0


def normal_equations(jacobians: Sequence[Array], rests: Sequence[Array]) -> tuple[Array, Array]:
    """Of the robust fit: the normal matrix, (k, k), and each trial's part of the slope, (trials, k)."""
    weighted = [j / (1.0 + (rest[:, None] / _ROBUST) ** 2) for j, rest in zip(jacobians, rests, strict=True)]
    normal = sum((w.T @ j for w, j in zip(weighted, jacobians, strict=True)), np.zeros((jacobians[0].shape[1],) * 2))
    return normal, np.array([w.T @ rest for w, rest in zip(weighted, rests, strict=True)])


def deviations(normal: Array, slopes: Array, rests: Sequence[Array]) -> Array:
    """Standard deviations of what was fitted, (k,): errors within a trial hang together, so trials are what counts.

    With few trials theirs say little; what residuals say, as if each were one by itself, is the least.
    """
    inverse = np.linalg.pinv(normal)
    rest = np.concatenate(rests)
    excess = float(np.average(rest**2, weights=1.0 / (1.0 + (rest / _ROBUST) ** 2)))
    least: Array = np.sqrt(np.diag(inverse) * max(excess, 1.0))
    trials = len(slopes)
    if trials < 2:
        return least
    clustered = inverse @ (slopes.T @ slopes) @ inverse * (trials / (trials - 1.0))
    return np.maximum(least, np.sqrt(np.diag(clustered)))


def cost(rests: Sequence[Array]) -> float:
    """What a fit makes least: far residuals count less."""
    return float(sum(np.sum(np.log1p((rest / _ROBUST) ** 2)) for rest in rests))


def lowest(places: Array, costs: Sequence[float]) -> float:
    """Where a cost is least: that of a grid, and a parabola through it and its neighbours."""
    best = int(np.argmin(costs))
    if not 0 < best < len(places) - 1:
        return float(places[best])
    before, here, after = costs[best - 1 : best + 2]
    curve, step = before - 2.0 * here + after, float(places[1] - places[0])
    return float(places[best]) + (0.5 * step * (before - after) / curve if curve > 0.0 else 0.0)


def middle_of(values: Array) -> float:
    """The median of the means of all pairs: not moved by a few that are far off, and nearly as sharp as a mean."""
    one, other = np.triu_indices(len(values))
    return float(np.median(0.5 * (values[one] + values[other])))


def mean_over(trace: Array, ticks: int) -> Array:
    """Means of so many rows that follow each other, (n - ticks + 1, k)."""
    means: Array = np.lib.stride_tricks.sliding_window_view(trace, ticks, axis=0).mean(axis=2)
    return means
