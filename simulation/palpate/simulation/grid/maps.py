"""Grid maps: one ambiguous sensor value per cell, a goal, and walls (paper, section 4 and Fig. 2).

The agent knows neither the map nor its position: it reads its cell's value, which other cells may share.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field
from string import ascii_uppercase
from typing import Final

from palpate.core.errors import ConfigurationError
from palpate.core.policy import COMPASS_NAMES, Action

GOAL: Final = "·"
WALL: Final = "#"
LARGEST: Final = 99
"""Maximum side length of a map, so that a mistyped size does not exhaust memory."""

CELL_M: Final = 1e-3
"""Cell length used in actions, chosen so that policy files contain whole millimetres."""

COMPASS: Final = ((1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1))
"""(dx, dy) of each action in cells, x to the right and y upwards, in the order of the insertion task's actions."""

_ALPHABET: Final = f"capital letters A to Z, {WALL} for a wall and one {GOAL} or . for the goal"


def grid_actions() -> tuple[Action, ...]:
    """Return the eight moves, named like the compass steps of the insertion task."""
    return tuple(
        Action(name, (CELL_M * dx, CELL_M * dy)) for name, (dx, dy) in zip(COMPASS_NAMES, COMPASS, strict=True)
    )


@dataclass(frozen=True)
class GridMap:
    """A map and the result of each move on it.

    Attributes:
        cells: (column, row) of each cell that the agent can occupy, in reading order, without the goal.
        readings: Each cell's sensor value, as an index into ``symbols``.
        moves: Next cell for each cell and action, (cells, 8); None is the goal. A move into a wall has no effect.

    Raises:
        ConfigurationError: The rows are not a map with exactly one goal that can be reached from every cell.
    """

    rows: tuple[str, ...]
    symbols: tuple[str, ...] = field(init=False, repr=False, compare=False)
    cells: tuple[tuple[int, int], ...] = field(init=False, repr=False, compare=False)
    readings: tuple[int, ...] = field(init=False, repr=False, compare=False)
    moves: tuple[tuple[int | None, ...], ...] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        rows = tuple(row.replace(".", GOAL) for row in self.rows)
        _check_rows(rows)
        places = [(x, y) for y, row in enumerate(rows) for x in range(len(row)) if row[x] in ascii_uppercase]
        if not places:
            raise ConfigurationError("grid.map", "/".join(rows), "at least one cell next to the goal")
        letters = [rows[y][x] for x, y in places]
        symbols = tuple(sorted(set(letters)))
        object.__setattr__(self, "rows", rows)
        object.__setattr__(self, "symbols", symbols)
        object.__setattr__(self, "cells", tuple(places))
        object.__setattr__(self, "readings", tuple(map(symbols.index, letters)))
        number: dict[tuple[int, int], int | None] = {place: cell for cell, place in enumerate(places)}
        number |= {(row.index(GOAL), y): None for y, row in enumerate(rows) if GOAL in row}
        # Rows are counted downwards, y upwards.
        near = (tuple(number.get((x + dx, y - dy), number[x, y]) for dx, dy in COMPASS) for x, y in places)
        object.__setattr__(self, "moves", tuple(near))
        reached = {cell for cell in self.distances if cell is not None}
        lost = next((place for cell, place in enumerate(places) if cell not in reached), None)
        if lost is not None:
            where = f"column {lost[0] + 1} of row {lost[1] + 1}"
            raise ConfigurationError("grid.map", where, "a cell from which the goal can be reached")

    @classmethod
    def from_text(cls, text: str) -> GridMap:
        """Return a map from lines of characters, one per row; leading and trailing empty lines are ignored.

        Raises:
            ConfigurationError: See the class.
        """
        return cls(tuple(line.strip() for line in text.strip().splitlines()))

    @classmethod
    def from_regions(cls, notation: str, size: int = 7) -> GridMap:
        """Return a square map from labels for eight regions, such as ``ABC/C·E/BDF``.

        The regions are the signs of (dx, dy) from a one-cell goal in the centre: the letters left, right, above and
        below the goal are strips one cell wide, and those in the corners are squares.

        Args:
            notation: Three rows of three labels, separated by ``/``, with the goal in the centre.

        Raises:
            ConfigurationError: The notation, the size or the resulting map (see the class) is invalid.
        """
        rows = tuple(row.strip().replace(".", GOAL) for row in notation.split("/"))
        goals = [place for place, letter in enumerate("".join(rows)) if letter == GOAL]
        if [len(row) for row in rows] != [3, 3, 3] or goals != [4]:
            raise ConfigurationError("grid.map", notation, f"three rows of three regions, such as ABC/C{GOAL}E/BDF")
        if not isinstance(size, int) or isinstance(size, bool) or size % 2 == 0 or not 3 <= size <= LARGEST:
            raise ConfigurationError("grid.size", size, f"an odd number of cells from 3 to {LARGEST}")
        half = (size - 1) // 2
        stretched = [row[0] * half + row[1] + row[2] * half for row in rows]
        return cls((stretched[0],) * half + (stretched[1],) + (stretched[2],) * half)

    @property
    def distances(self) -> dict[int | None, int]:
        """Minimum number of steps to the goal from each cell that can reach it. The key of the goal is None."""
        before: dict[int | None, set[int]] = {}
        for cell, targets in enumerate(self.moves):
            for target in targets:
                before.setdefault(target, set()).add(cell)
        found: dict[int | None, int] = {None: 0}
        queue: deque[int | None] = deque((None,))
        while queue:
            target = queue.popleft()
            for cell in sorted(before.get(target, ())):
                if cell not in found:
                    found[cell] = found[target] + 1
                    queue.append(cell)
        return found

    def __str__(self) -> str:
        return "\n".join(self.rows)


SCENARIO_1: Final = "ABC/C·E/BDF"
"""The first scenario: six symbols, two of them replicated.

The paper's layout is not available. Of all ways to label the eight regions, two yield the string in Fig. 2 and
otherwise agree with the paper. This is one of them.
"""
SCENARIO_2: Final = "ABA/C·D/DBC"
"""The second scenario: four symbols, all replicated; one of two ways to label the regions that agree with the paper."""
TWIN: Final = "ABC/C·D/DAB"
"""The other candidate for the second scenario."""

SCENARIOS: Final = {"1": SCENARIO_1, "2": SCENARIO_2, "twin": TWIN}


def _check_rows(rows: tuple[str, ...]) -> None:
    whole = "/".join(rows)
    if not rows or not rows[0]:
        raise ConfigurationError("grid.map", whole, "at least one row")
    for number, row in enumerate(rows, 1):
        strange = next((c for c in row if c not in ascii_uppercase and c not in (GOAL, WALL)), None)
        if strange is not None:
            raise ConfigurationError("grid.map", f"{strange} in row {number}", _ALPHABET)
        if len(row) != len(rows[0]):
            accepted = f"{len(rows[0])} cells, as in the first row"
            raise ConfigurationError("grid.map", f"{len(row)} cells in row {number}", accepted)
    if max(len(rows), len(rows[0])) > LARGEST:
        raise ConfigurationError("grid.map", f"{len(rows)} rows of {len(rows[0])}", f"at most {LARGEST} each")
    if whole.count(GOAL) != 1:
        raise ConfigurationError("grid.map", f"{whole.count(GOAL)} goals in {whole}", f"one goal, {GOAL} or .")
