"""The places where the hole may be: a square grid."""

from __future__ import annotations

from math import ceil, floor
from typing import Any, Final

import numpy as np

from palpate.core.policy.belief.arithmetic import Floats

PITCH_M: Final = 1e-4
"""Distance between places."""
SINGLE: Final[np.dtype[Any]] = np.dtype(np.float32)
"""What is believed of each place is computed in single precision: quicker, and rounded by far less than a sensor's
noise."""


def off_way_m2(x_m: Floats, y_m: Floats, dx_m: float, dy_m: float) -> Floats:
    """Squared distances of these points from the straight way from the origin to (dx, dy)."""
    length = dx_m * dx_m + dy_m * dy_m
    along = np.clip((x_m * dx_m + y_m * dy_m) / length, 0.0, 1.0) if length > 0.0 else np.zeros_like(x_m)
    off_x, off_y = x_m - along * dx_m, y_m - along * dy_m
    squared: Floats = off_x * off_x + off_y * off_y
    return squared


class Places:
    """The upright square of places, centred at the nominal goal.

    Attributes:
        axis_m: Their coordinates, in x as in y, (size,).
    """

    def __init__(self, half_width_m: float) -> None:
        half = ceil(half_width_m / PITCH_M)
        self.size = 2 * half + 1
        self.axis_m: Floats = np.arange(-half, half + 1, dtype=np.float64) * PITCH_M
        self._half = half

    def cell(self, x_m: float, y_m: float) -> tuple[int, int]:
        """Row and column, x and y, of the nearest place; those beyond the edge have cells beyond it, too."""
        return round(x_m / PITCH_M) + self._half, round(y_m / PITCH_M) + self._half

    def likeliest_m(self, belief: Floats) -> tuple[float, float]:
        """The place of the greatest belief, (x, y)."""
        row, column = divmod(int(np.argmax(belief)), self.size)
        return float(self.axis_m[row]), float(self.axis_m[column])

    def mean_m(self, belief: Floats) -> tuple[float, float]:
        """The mean place, (x, y)."""
        along_x, along_y = np.add.reduce(belief, axis=1), np.add.reduce(belief, axis=0)
        return float(np.add.reduce(along_x * self.axis_m)), float(np.add.reduce(along_y * self.axis_m))

    def near_way(
        self, from_m: tuple[float, float], way_m: tuple[float, float], within_m: float
    ) -> tuple[tuple[slice, slice], Floats]:
        """The places that may be within a distance of a straight way: an upright box, and their squared distances."""
        x, y = (self._span(start, start + way, within_m) for start, way in zip(from_m, way_m, strict=True))
        return (x, y), off_way_m2(self.axis_m[x, None] - from_m[0], self.axis_m[None, y] - from_m[1], *way_m)

    def _span(self, start_m: float, end_m: float, within_m: float) -> slice:
        first, last = (min(start_m, end_m) - within_m) / PITCH_M, (max(start_m, end_m) + within_m) / PITCH_M
        return slice(max(floor(first) + self._half, 0), max(ceil(last) + self._half + 1, 0))
