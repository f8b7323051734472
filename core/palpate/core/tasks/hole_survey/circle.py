"""The circle through places where a wall was touched, and how surely it is known. Plain floats: equal bits anywhere."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import hypot, sqrt
from typing import Final

_ROUNDS: Final = 8
_SINGULAR: Final = 1e-6
"""Of 8 places all round the determinant is some 0.06; below this they lie on too short an arc."""
Row = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Circle:
    """A fitted circle.

    Attributes:
        centre_m: Its centre, (x, y).
        radius_m: Its radius.
        centre_sd_m: Standard uncertainty of x and y, from the scatter of the places alone.
        radius_sd_m: That of the radius.
        scatter_m: Standard deviation of a place's distance from the circle, for the degrees of freedom left.
    """

    centre_m: tuple[float, float]
    radius_m: float
    centre_sd_m: tuple[float, float]
    radius_sd_m: float
    scatter_m: float


def fit_circle(places_m: Sequence[tuple[float, float]]) -> Circle | None:
    """Least squares of the distances from the circle, by Gauss-Newton from the places' mean.

    Args:
        places_m: At least three, (x, y).

    Returns:
        The circle; None where the places determine none.
    """
    count = len(places_m)
    cx, cy = sum(x for x, _ in places_m) / count, sum(y for _, y in places_m) / count
    radius = sum(hypot(x - cx, y - cy) for x, y in places_m) / count
    left = _ROUNDS
    while True:
        rows: list[Row] = []
        misses: list[float] = []
        for x, y in places_m:
            away = hypot(x - cx, y - cy)
            misses.append(away - radius)
            # A place in the centre lies in no direction.
            away = max(away, 1e-300)
            rows.append(((x - cx) / away, (y - cy) / away, 1.0))
        inverse = _inverse([[sum(row[i] * row[j] for row in rows) / count for j in range(3)] for i in range(3)])
        if inverse is None:
            return None
        slope = [sum(row[i] * miss for row, miss in zip(rows, misses, strict=True)) / count for i in range(3)]
        if not left:
            scatter = sqrt(sum(miss * miss for miss in misses) / max(count - 3, 1))
            sx, sy, sr = (scatter * sqrt(inverse[i][i] / count) for i in range(3))
            return Circle((cx, cy), radius, (sx, sy), sr, scatter)
        dx, dy, dr = (sum(each * s for each, s in zip(row, slope, strict=True)) for row in inverse)
        cx, cy, radius, left = cx + dx, cy + dy, radius + dr, left - 1


def _inverse(m: list[list[float]]) -> list[list[float]] | None:
    """The inverse of a symmetric 3 x 3 matrix that ends in a 1 by its cofactors; None where it has none."""
    (a, b, c), (_, d, e), _ = m
    cofactors = [[d - e * e, c * e - b, b * e - c * d],
                 [c * e - b, a - c * c, b * c - a * e],
                 [b * e - c * d, b * c - a * e, a * d - b * b]]  # fmt: skip
    determinant = a * cofactors[0][0] + b * cofactors[0][1] + c * cofactors[0][2]
    if determinant < _SINGULAR:
        return None
    return [[each / determinant for each in row] for row in cofactors]
