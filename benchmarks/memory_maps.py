"""Learners on random grid maps, compared with the exact optimum of a belief about the position on the map.

    python -m benchmarks.memory_maps --maps 1 2 twin 3000-3029 --seeds 3 --jobs 2 --out maps.jsonl

Maps have 5 x 5 to 11 x 11 cells, and 3 to 8 symbols that are drawn independently for each cell. Two of five maps have
12 % of walls. Maps 1, 2 and twin are those of the paper. A frozen learned policy starts from every cell, once if it
reaches the goal without a random choice (which is exact), otherwise --walks times. The ratio is relative to the
optimum, in steps, limited to 100 as in trials. Maps whose optimum takes too long to compute are rejected and counted.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import lru_cache
from statistics import mean, median
from time import process_time
from typing import Any

import numpy as np

from benchmarks.common import Cell, parser_of, seeds_of, sweep, table
from palpate.adapters.config import GridLearning
from palpate.adapters.experiments.grid import Bounds, LearningRun, bounds_of, grid_named, learn, states_named
from palpate.core.errors import ConfigurationError
from palpate.core.policy import TabularLearner
from palpate.core.policy.hmm import GREEDY_ACTIONS, HmmLearner
from palpate.simulation.grid import GOAL, SCENARIOS, WALL, GridMap, Walk, grid_actions, walks_from_all_cells

LETTERS = "ABCDEFGH"
Q_LEARNING, HMM = GridLearning(), replace(GridLearning(), learner="hmm")
LEARNERS: dict[str, tuple[str, GridLearning, int]] = {
    "symbols": ("symbols", Q_LEARNING, 500),
    "last-2": ("last-2", Q_LEARNING, 500),
    "last-3": ("last-3", Q_LEARNING, 500),
    "hmm-100": ("symbols", HMM, 100),
    "hmm-500": ("symbols", HMM, 500),
    "hmm-1500": ("symbols", HMM, 1500),
}
"""States, settings and number of trials of each learner."""


def random_map(seed: int) -> GridMap:
    """Return a random map."""
    rng = np.random.default_rng(seed)
    while True:
        (width, height), symbols = rng.integers(5, 12, size=2), int(rng.integers(3, 9))
        cells = [[LETTERS[letter] for letter in row] for row in rng.integers(symbols, size=(height, width))]
        if rng.random() < 0.4:
            walls = rng.random((height, width)) < 0.12
            cells = [
                [WALL if wall else cell for wall, cell in zip(*rows, strict=True)]
                for rows in zip(walls, cells, strict=True)
            ]
        cells[int(rng.integers(height))][int(rng.integers(width))] = GOAL
        try:
            return GridMap(tuple("".join(row) for row in cells))
        except ConfigurationError:  # cells without a way to the goal
            continue


@lru_cache(maxsize=4)
def facts(name: str) -> tuple[GridMap, Bounds]:
    """Return a map and its bounds. The names 1, 2 and twin mean the paper's maps; other numbers seed random maps."""
    grid = grid_named(name, 7) if name in SCENARIOS else random_map(int(name))
    return grid, bounds_of(grid)


def frozen_walks(grid: GridMap, run: LearningRun, walks: int) -> tuple[list[Walk], bool]:
    """Run the learned policy from every cell as in normal use. Return the walks, and whether their mean is exact."""
    if isinstance(run.learner, TabularLearner):
        run.learner.frozen = True
        return walks_from_all_cells(grid, run.identifier, run.learner, walks=walks, seed=1), False
    policy = HmmLearner(grid.symbols, grid_actions(), run.learner.parameters, frozen=True)
    policy.set_state(run.learner.get_state())
    sure = walks_from_all_cells(grid, run.identifier, policy, step_limit=GREEDY_ACTIONS, seed=1)
    if all(walk.reached for walk in sure):
        return sure, True
    return walks_from_all_cells(grid, run.identifier, policy, walks=walks, seed=1), False


def run(cell: Cell) -> dict[str, Any]:
    """Run one learner on one map."""
    grid, bounds = facts(cell["map"])
    if bounds.belief is None:
        return {}
    states, settings, trials = LEARNERS[cell["learner"]]
    began = process_time()
    learned = learn(grid, states_named(states, grid), settings, cell["seed"], trials)
    cpu_s = round(process_time() - began, 2)
    found, exact = frozen_walks(grid, learned, cell["walks"])
    ratio = mean(walk.steps for walk in found) / bounds.belief
    reached = mean(walk.reached for walk in found)
    random = bounds.random_walk / bounds.belief
    return {"ratio": ratio, "reached": reached, "exact": exact, "random": random, "cpu_s": cpu_s}


def lines_of(found: list[tuple[Cell, dict[str, Any]]]) -> Iterator[str]:
    """Yield a line for each learner: the median and the worst ratio, and the runs that fail from some start."""
    maps, scored = {cell["map"] for cell, _ in found}, [(cell, one) for cell, one in found if one]
    refused = maps - {cell["map"] for cell, _ in scored}
    yield f"{len(maps)} maps, {len(refused)} refused: {' '.join(sorted(refused)) or 'none'}\n"
    rows: list[tuple[object, ...]] = []
    for learner in dict.fromkeys(cell["learner"] for cell, _ in scored):
        ours = [one for cell, one in scored if cell["learner"] == learner]
        ratios, cpu_s = [one["ratio"] for one in ours], [one["cpu_s"] for one in ours]
        lost = sum(one["reached"] < 1.0 for one in ours)
        rows.append(
            (learner, len(ours), f"{median(ratios):.3f}", f"{max(ratios):.3f}", lost, median(cpu_s), max(cpu_s))
        )
    walk = [one["random"] for _, one in scored] or [0.0]
    rows.append(("random walk", "", f"{median(walk):.3f}", f"{max(walk):.3f}", "", "", ""))
    yield table(("learner", "runs", "median", "worst", "loses a start", "CPU s, median", "most"), rows)
    below = sum(one["exact"] and one["ratio"] < 1.0 - 1e-9 for _, one in scored)
    yield f"\nbelow the optimum: {below}"


def span(text: str) -> list[str]:
    """Return ``3000-3029`` as separate numbers, and any other name unchanged."""
    first, dash, last = text.partition("-")
    return [str(number) for number in range(int(first), int(last) + 1)] if dash else [text]


def main() -> None:
    parser = parser_of(__doc__, seeds=1, first_seed=0, trials=0)
    parser.add_argument("--maps", nargs="+", type=span, default=[["1"], ["2"], ["twin"]])
    parser.add_argument("--learners", nargs="+", choices=list(LEARNERS), default=["symbols", "last-2", "hmm-500"])
    parser.add_argument("--walks", type=int, default=20, help="walks from each cell, where chance has a part")
    options = parser.parse_args()
    # Map by map, so that an optimum is found once.
    cells = [
        {"map": name, "learner": learner, "seed": seed, "walks": options.walks}
        for names in options.maps
        for name in names
        for learner in options.learners
        for seed in seeds_of(options)
    ]
    print("\n".join(lines_of(sweep(options, run, cells))))


if __name__ == "__main__":
    main()
