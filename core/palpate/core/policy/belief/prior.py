"""Where holes are before anything was touched, by where they were in the trials before."""

from collections.abc import Sequence
from math import exp, pi
from typing import Final

import numpy as np

from palpate.core.policy.belief.arithmetic import Floats, exponential
from palpate.core.policy.belief.places import Places

_WIDTHS_M: Final = (1e-4, 3e-4, 1e-3)
"""Widths of the kernels: holes that stay, holes that are about there, and holes that are anywhere."""
_MEMORY: Final = 0.9
"""A width's success at foretelling counts less by this from trial to trial, so that a hole that moves is followed."""
_LEAST: Final = 1e-9

Hole = tuple[float, float]


def place_prior(holes_m: Sequence[Hole], places: Places) -> Floats:
    """The prior over places, (size, size), all above 0.

    A mixture of kernel densities of different widths and an even one, each weighted by how well it foretold each hole
    from those before it.

    Args:
        holes_m: Where holes were found, (x, y), the oldest first.
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
    """Weights of the kernels, and last of the even density."""
    even = 1.0 / area_m2
    scores = [1.0] * (len(_WIDTHS_M) + 1)
    for number, (x, y) in enumerate(holes_m):
        before = holes_m[:number]
        foretold = [_density(before, x, y, width) if before else even for width in _WIDTHS_M]
        scores = [
            score**_MEMORY * (value / even + 1e-3) for score, value in zip(scores, [*foretold, even], strict=True)
        ]
        total = sum(scores)
        scores = [score / total for score in scores]
    total = sum(scores)
    # The even part never vanishes: whatever was never seen may still come.
    return [0.98 * score / total for score in scores[:-1]] + [0.98 * scores[-1] / total + 0.02]


def _density(holes_m: Sequence[Hole], x: float, y: float, width: float) -> float:
    scale = -0.5 / (width * width)
    total = sum(exp(scale * ((x - hx) ** 2 + (y - hy) ** 2)) for hx, hy in holes_m)
    return total / (len(holes_m) * 2 * pi * width * width)


def _kernel(offset_m: Floats, width: float) -> Floats:
    scaled = offset_m / width
    density: Floats = exponential(-0.5 * scaled * scaled) * (1.0 / (width * (2 * pi) ** 0.5))
    return density
