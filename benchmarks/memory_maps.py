"""Learners on random grid maps, compared with the exact optimum of a belief over the places of the map.

    python -m benchmarks.memory_maps --maps 1 2 twin 3000-3029 --seeds 3 --jobs 2 --out maps.jsonl

Maps of 5 x 5 to 11 x 11 cells, 3 to 8 symbols drawn for each cell alone, in two of five maps 12 % of walls; 1, 2 and
twin are those of the paper. A learned policy is frozen and walked from every cell: once where it reaches the goal
before it leaves anything to chance, which is exact, else --walks times. The ratio is to the optimum, of steps that are
cut off at 100, as trials are. Maps whose optimum takes too long to find are refused, and counted.
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
"""States, settings and trials of each."""


def random_map(seed: int) -> GridMap:
    """A map that nobody chose."""
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
    """A map of the paper, or a random one by its seed, and what is possible there; 2 alone is the paper's."""
    grid = grid_named(name, 7) if name in SCENARIOS else random_map(int(name))
    return grid, bounds_of(grid)


def frozen_walks(grid: GridMap, run: LearningRun, walks: int) -> tuple[list[Walk], bool]:
    """Trials of the learned policy from every cell, as it would act in use, and whether their mean is exact."""
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
    """One learning run."""
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
    """A line for each learner: median and worst ratio, and the runs that lose a start."""
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
    """``3000-3029`` as its numbers; a name as it is."""
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
