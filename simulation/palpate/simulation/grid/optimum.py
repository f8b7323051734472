"""The optimum with full information: with map and place known no policy needs fewer steps."""

from __future__ import annotations

from fractions import Fraction

from palpate.simulation.grid.maps import COMPASS, GridMap


def full_information_optimum(grid: GridMap) -> Fraction:
    """Mean length of the shortest ways to the goal, from a uniformly random start."""
    return Fraction(sum(grid.distances.values()), len(grid.cells))


def best_actions(grid: GridMap) -> tuple[tuple[int, ...], ...]:
    """For each symbol the actions that shorten the way from every cell with that symbol, (symbols, any number).

    Where there are none, no action is the right one for the symbol, and who sees nothing else must be confused
    (paper, section 4).
    """
    distances = grid.distances
    shared = [set(range(len(COMPASS))) for _ in grid.symbols]
    for cell, targets in enumerate(grid.moves):
        nearer = {action for action, target in enumerate(targets) if distances[target] < distances[cell]}
        shared[grid.readings[cell]] &= nearer
    return tuple(tuple(sorted(actions)) for actions in shared)
