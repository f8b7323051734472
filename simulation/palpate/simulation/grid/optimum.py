"""The optimum with full information: nobody who sees the map and the place needs fewer steps."""

from __future__ import annotations

from fractions import Fraction

from palpate.simulation.grid.maps import GridMap


def full_information_optimum(grid: GridMap) -> Fraction:
    """Mean length of the shortest ways to the goal, from a uniformly random start."""
    return Fraction(sum(grid.distances.values()), len(grid.cells))
