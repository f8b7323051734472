"""The grid of possible hole positions, and their prior probabilities."""

from __future__ import annotations

from collections.abc import Sequence
from math import ceil, exp, floor, fsum, pi
from typing import Any, Final

import numpy as np

from palpate.core.policy.belief.arithmetic import Floats, exponential

PITCH_M: Final = 1e-4
"""Distance between grid points."""
SINGLE: Final[np.dtype[Any]] = np.dtype(np.float32)
"""Data type for beliefs. Single precision is faster, and its rounding errors are far below a sensor's noise."""
_WIDTHS_M: Final = (1e-4, 3e-4, 1e-3)
"""Kernel widths, for hole positions that are constant, vary slightly, or vary widely."""
_MEMORY: Final = 0.9
"""Forgetting factor, per trial, for a width's predictive success, so that moving holes are tracked."""
_LEAST: Final = 1e-9

Hole = tuple[float, float]


def off_path_m2(x_m: Floats, y_m: Floats, dx_m: float, dy_m: float) -> Floats:
    """Return the squared distances of points from the straight path from the origin to (dx, dy)."""
    length = dx_m * dx_m + dy_m * dy_m
    along = np.clip((x_m * dx_m + y_m * dy_m) / length, 0.0, 1.0) if length > 0.0 else np.zeros_like(x_m)
    off_x, off_y = x_m - along * dx_m, y_m - along * dy_m
    squared: Floats = off_x * off_x + off_y * off_y
    return squared


class Places:
    """A square grid of positions, centred at the nominal goal and parallel to its axes.

    Attributes:
        axis_m: Coordinates, the same for x and y, (size,).
    """

    def __init__(self, half_width_m: float) -> None:
        half = ceil(half_width_m / PITCH_M)
        self.size = 2 * half + 1
        self.axis_m: Floats = np.arange(-half, half + 1, dtype=np.float64) * PITCH_M
        self._half = half

    def cell(self, x_m: float, y_m: float) -> tuple[int, int]:
        """Return the row and column (x and y) of the nearest grid point; numbering continues beyond the grid."""
        return round(x_m / PITCH_M) + self._half, round(y_m / PITCH_M) + self._half

    def likeliest_m(self, belief: Floats) -> tuple[float, float]:
        """Return the most probable position, (x, y)."""
        row, column = divmod(int(np.argmax(belief)), self.size)
        return float(self.axis_m[row]), float(self.axis_m[column])

    def mean_m(self, belief: Floats) -> tuple[float, float]:
        """Return the mean position, (x, y)."""
        along_x, along_y = np.add.reduce(belief, axis=1), np.add.reduce(belief, axis=0)
        return float(np.add.reduce(along_x * self.axis_m)), float(np.add.reduce(along_y * self.axis_m))

    def near_way(
        self, from_m: tuple[float, float], displacement_m: tuple[float, float], within_m: float
    ) -> tuple[tuple[slice, slice], Floats]:
        """Return a box of all cells within a given distance of a straight path, and their squared distances from it."""
        x, y = (self._span(start, start + move, within_m) for start, move in zip(from_m, displacement_m, strict=True))
        return (x, y), off_path_m2(self.axis_m[x, None] - from_m[0], self.axis_m[None, y] - from_m[1], *displacement_m)

    def _span(self, start_m: float, end_m: float, within_m: float) -> slice:
        first, last = (min(start_m, end_m) - within_m) / PITCH_M, (max(start_m, end_m) + within_m) / PITCH_M
        return slice(max(floor(first) + self._half, 0), max(ceil(last) + self._half + 1, 0))


def place_prior(holes_m: Sequence[Hole], places: Places) -> Floats:
    """Return the prior over positions, (size, size), all above 0.

    It is a mixture of kernel densities of several widths and a uniform density. Each component is weighted by how well
    it predicted each hole from the preceding ones.

    Args:
        holes_m: Earlier hole positions, (x, y), oldest first.
    """
    area = (places.size * float(places.axis_m[1] - places.axis_m[0])) ** 2
    weights = _weights(holes_m, area)
    density = np.full((places.size, places.size), weights[-1] / area)
    for width, weight in zip(_WIDTHS_M, weights, strict=False):
        for x, y in holes_m:
            row, column = _kernel(places.axis_m - x, width), _kernel(places.axis_m - y, width)
            density += weight / len(holes_m) * row[:, None] * column[None, :]
    density /= density.sum()
    density += _LEAST / density.size
    return density


def _weights(holes_m: Sequence[Hole], area_m2: float) -> list[float]:
    """Return the kernel weights, followed by the weight of the uniform density."""
    even = 1.0 / area_m2
    scores = [1.0] * (len(_WIDTHS_M) + 1)
    for number, (x, y) in enumerate(holes_m):
        before = holes_m[:number]
        foretold = [_density(before, x, y, width) if before else even for width in _WIDTHS_M]
        scores = [
            score**_MEMORY * (value / even + 1e-3) for score, value in zip(scores, [*foretold, even], strict=True)
        ]
        total = fsum(scores)
        scores = [score / total for score in scores]
    total = fsum(scores)
    # The uniform part never vanishes, because a hole may be where none has been before.
    return [0.98 * score / total for score in scores[:-1]] + [0.98 * scores[-1] / total + 0.02]


def _density(holes_m: Sequence[Hole], x: float, y: float, width: float) -> float:
    scale = -0.5 / (width * width)
    total = fsum(exp(scale * ((x - hx) ** 2 + (y - hy) ** 2)) for hx, hy in holes_m)
    return total / (len(holes_m) * 2 * pi * width * width)


def _kernel(offset_m: Floats, width: float) -> Floats:
    scaled = offset_m / width
    density: Floats = exponential(-0.5 * scaled * scaled) * (1.0 / (width * (2 * pi) ** 0.5))
    return density
