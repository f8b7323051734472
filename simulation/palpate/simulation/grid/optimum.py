"""Baselines: mean number of steps of a random walk, and minimum number with a known position or only a known map.

Moves and readings are deterministic, so a belief is the set of possible cells with their multiplicities: walls may move
two possible positions into the same cell. The number of such beliefs is finite, and no optimal plan visits one twice,
because nothing would have been learned in between (Bonet, "Deterministic POMDPs Revisited"). A search similar to LAO*
finds the best plan: values start at the cost with full information, which is a lower bound, and are backed up along the
greedy plan until no value changes. Counts are integers, so this test is exact.

The belief-state optimum is a lower bound for every policy over symbols, past symbols or automaton states: a better
result indicates an information leak.
"""

from collections import Counter
from fractions import Fraction
from functools import lru_cache
from typing import Final, TypeAlias

import numpy as np

from palpate.core.errors import ConfigurationError
from palpate.simulation.grid.maps import COMPASS, GridMap


def full_information_optimum(grid: GridMap) -> Fraction:
    """Return the mean length of the shortest paths to the goal from a uniformly random start."""
    return Fraction(sum(grid.distances.values()), len(grid.cells))


def random_walk_steps(grid: GridMap, step_limit: int) -> float:
    """Return the exact mean number of steps of a random walk from a uniformly random start, truncated at the limit."""
    goal = len(grid.cells)
    targets = np.array([[goal if target is None else target for target in row] for row in grid.moves])
    here, steps = np.full(goal, 1.0 / goal), 0.0
    for _ in range(step_limit):
        steps += float(here.sum())
        arriving = np.repeat(here / len(COMPASS), len(COMPASS))
        here = np.bincount(targets.ravel(), arriving, goal + 1)[:goal]
    return steps


Belief: TypeAlias = tuple[tuple[int, int], ...]
"""Possible cells in ascending order, each with the number of starts that lead there."""

MOST_CELLS: Final = 2_000_000
"""Search limit, in cells of visited beliefs. It is reached in less than a minute. The paper's maps need thousands, and
15 x 15 maps need tens of thousands."""
MOST_BLIND_CELLS: Final = 100_000
"""The limit for maps with a single symbol, whose readings contain no information: 15 cells need 8400, 19 about 62 000
and 24 about 595 000. The search reaches the limit in one or two seconds."""


@lru_cache(maxsize=64)
def belief_optimum(grid: GridMap, most_cells: int | None = None) -> Fraction:
    """Return the mean number of steps of the best policy that uses all past readings and actions, from a random start.

    ``most_cells`` limits the number of cells in visited beliefs.

    Raises:
        ConfigurationError: The search exceeds the limit.
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
        # For each visited belief: the beliefs that may follow each useful action.
        self._outcomes: dict[Belief, tuple[tuple[Belief, ...], ...]] = {}

    def divided(self, possible: Counter[int]) -> tuple[Belief, ...]:
        """Return the possible cells grouped by reading."""
        parts: dict[int, list[tuple[int, int]]] = {}
        for cell in sorted(possible):
            parts.setdefault(self._grid.readings[cell], []).append((cell, possible[cell]))
        return tuple(tuple(parts[reading]) for reading in sorted(parts))

    def solve(self, root: Belief) -> int:
        """Return the minimum number of steps, summed over the starts of the belief."""
        while self._swept(root):
            pass
        return self._values[root]

    def _swept(self, root: Belief) -> bool:
        """Back up every belief in the greedy plan, from last to first; return True if a value changed."""
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
        """Return the value of a belief, from the values of its successors, and the successors of the best action."""
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
            if parts != (belief,):  # an action that changes nothing is never the best
                outcomes[parts] = None
        for parts in outcomes:
            for part in parts:
                self._bound(part)
        self._outcomes[belief] = tuple(outcomes)

    def _bound(self, belief: Belief) -> None:
        if belief not in self._values:
            self._values[belief] = sum(count * self._distances[cell] for cell, count in belief)
