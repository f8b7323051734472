"""Yardsticks: the fewest steps with full information, and with the map known but not the place; the random walk.

Moves and readings are certain here, so all that can be known is which cells are still possible, and how often: where
the walls push two possible places together, one cell stands for both. Such beliefs are finite in number, and no optimal
plan meets one twice, since nothing would have been learned in between (Bonet, "Deterministic POMDPs Revisited"). The
best plan is found by LAO*-like search: values begin at what full information would need, which is never too much, and
are backed up along the greedy plan until nothing changes. Counts are whole numbers, so "nothing" is exact.

The belief-state optimum bounds every policy over symbols, past symbols or automaton states
from below: a better result has a leak.
"""

from collections import Counter
from fractions import Fraction
from functools import lru_cache
from typing import Final, TypeAlias

import numpy as np

from palpate.core.errors import ConfigurationError
from palpate.simulation.grid.maps import COMPASS, GridMap


def full_information_optimum(grid: GridMap) -> Fraction:
    """Mean length of the shortest ways to the goal, from a uniformly random start."""
    return Fraction(sum(grid.distances.values()), len(grid.cells))


def random_walk_steps(grid: GridMap, step_limit: int) -> float:
    """Mean steps of the random walk from a uniformly random start, cut off at the limit; exact."""
    goal = len(grid.cells)
    targets = np.array([[goal if target is None else target for target in row] for row in grid.moves])
    here, steps = np.full(goal, 1.0 / goal), 0.0
    for _ in range(step_limit):
        steps += float(here.sum())
        arriving = np.repeat(here / len(COMPASS), len(COMPASS))
        here = np.bincount(targets.ravel(), arriving, goal + 1)[:goal]
    return steps


Belief: TypeAlias = tuple[tuple[int, int], ...]
"""Possible cells in rising order, each with how many of the starts have led there."""

MOST_CELLS: Final = 2_000_000
"""Cells of beliefs that the search may look at before it gives up, after less than a minute. The maps of the paper need
some thousands, maps of 15 x 15 some tens of thousands."""
MOST_BLIND_CELLS: Final = 100_000
"""The same where there is one symbol alone, so that reading parts nothing: 15 cells need 8400, 19 some 62 000 and 24
some 595 000. It takes a second or two."""


@lru_cache(maxsize=64)
def belief_optimum(grid: GridMap, most_cells: int | None = None) -> Fraction:
    """Mean steps to the goal of the best policy over all that was read and done, from a uniformly random start.

    Args:
        most_cells: Bound of the effort: cells of all beliefs that are looked at; None takes ``MOST_CELLS``, or
            ``MOST_BLIND_CELLS``.

    Raises:
        ConfigurationError: More of them would have to be looked at.
    """
    if most_cells is None:
        most_cells = MOST_CELLS if len(grid.symbols) > 1 else MOST_BLIND_CELLS
    search = _BeliefSearch(grid, most_cells)
    starts = search.divided(Counter(range(len(grid.cells))))
    return Fraction(sum(map(search.solve, starts)), len(grid.cells))


class _BeliefSearch:
    def __init__(self, grid: GridMap, most_cells: int) -> None:
        self._grid, self._left = grid, most_cells
        self._distances = grid.distances
        self._values: dict[Belief, int] = {}
        # Of each belief that was looked at: what each useful action leads to, and the steps that are spent on it.
        self._outcomes: dict[Belief, tuple[tuple[Belief, ...], ...]] = {}

    def divided(self, possible: Counter[int]) -> tuple[Belief, ...]:
        """What is left of the possible cells by each reading."""
        parts: dict[int, list[tuple[int, int]]] = {}
        for cell in sorted(possible):
            parts.setdefault(self._grid.readings[cell], []).append((cell, possible[cell]))
        return tuple(tuple(parts[reading]) for reading in sorted(parts))

    def solve(self, root: Belief) -> int:
        """Fewest steps in all, summed over the starts that the belief stands for."""
        while self._swept(root):
            pass
        return self._values[root]

    def _swept(self, root: Belief) -> bool:
        """Back up every belief of the greedy plan, those that come last first; whether any value changed."""
        changed = False
        seen = {root}
        stack = [(root, False)]
        while stack:
            belief, left = stack.pop()
            if left:
                value = self._best(belief)[0]
                changed = changed or value != self._values[belief]
                self._values[belief] = value
                continue
            stack.append((belief, True))
            for part in self._best(belief)[1]:
                if part not in seen:
                    seen.add(part)
                    stack.append((part, False))
        return changed

    def _best(self, belief: Belief) -> tuple[int, tuple[Belief, ...]]:
        """Value of a belief by those of what may follow, and what follows the best action."""
        if belief not in self._outcomes:
            self._expand(belief)
        values = self._values
        follows = min(self._outcomes[belief], key=lambda parts: sum(values[part] for part in parts))
        return sum(count for _, count in belief) + sum(values[part] for part in follows), follows

    def _expand(self, belief: Belief) -> None:
        self._left -= len(belief)
        if self._left < 0:
            accepted = "one of which the belief-state optimum takes less effort"
            raise ConfigurationError("grid.map", "/".join(self._grid.rows), accepted)
        self._bound(belief)
        outcomes: dict[tuple[Belief, ...], None] = {}
        for action in range(len(COMPASS)):
            possible: Counter[int] = Counter()
            for cell, count in belief:
                target = self._grid.moves[cell][action]
                if target is not None:
                    possible[target] += count
            parts = self.divided(possible)
            if parts != (belief,):  # an action that changes nothing is never a best one
                outcomes[parts] = None
        for parts in outcomes:
            for part in parts:
                self._bound(part)
        self._outcomes[belief] = tuple(outcomes)

    def _bound(self, belief: Belief) -> None:
        if belief not in self._values:
            self._values[belief] = sum(count * self._distances[cell] for cell, count in belief)
