"""Learners on random grid maps, compared with the exact optimum of a belief over the places of the map.

    python -m benchmarks.memory_maps --maps 1 2 twin 3000-3029 --seeds 0 1 2 --jobs 1 --out maps.jsonl

Maps of 5 x 5 to 11 x 11 cells, 3 to 8 symbols drawn for each cell alone, in two of five maps 12 % of walls; 1, 2 and
twin are those of the paper. A learned policy is frozen and walked from every cell: once where it reaches the goal
before it leaves anything to chance, which is exact, else --walks times. The ratio is to the optimum, of steps that are
cut off at 100, as trials are. Maps whose optimum takes too long to find are refused, and counted.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterator
from dataclasses import replace
from functools import lru_cache
from multiprocessing import Pool
from pathlib import Path
from statistics import mean, median
from time import process_time
from typing import Any

import numpy as np

from palpate.adapters.config import GridLearning
from palpate.adapters.experiments.grid import Bounds, LearningRun, Named, bounds_of, grid_named, learn
from palpate.core.errors import ConfigurationError
from palpate.core.policy import TabularLearner
from palpate.core.policy.hmm import PATIENCE
from palpate.simulation.grid import GOAL, SCENARIOS, WALL, GridMap, Walk, walks_from_all_cells

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
    policy = run.learner.as_frozen()
    sure = walks_from_all_cells(grid, run.identifier, policy, step_limit=PATIENCE, seed=1)
    if all(walk.reached for walk in sure):
        return sure, True
    return walks_from_all_cells(grid, run.identifier, policy, walks=walks, seed=1), False


def run_one(job: tuple[str, str, int, int]) -> dict[str, Any]:
    """One learning run, as a line of the file."""
    name, learner, seed, walks = job
    line: dict[str, Any] = {"map": name, "learner": learner, "seed": seed}
    grid, bounds = facts(name)
    if bounds.belief is None:
        return line
    states, settings, trials = LEARNERS[learner]
    began = process_time()
    run = learn(grid, Named(states), settings, seed, trials)
    line["cpu_s"] = round(process_time() - began, 2)
    found, exact = frozen_walks(grid, run, walks)
    ratio = mean(walk.steps for walk in found) / bounds.belief
    reached = mean(walk.reached for walk in found)
    return line | {"ratio": ratio, "reached": reached, "exact": exact, "random": bounds.random_walk / bounds.belief}


def table(lines: list[dict[str, Any]]) -> Iterator[str]:
    """A line for each learner: median and worst ratio, and the runs that lose a start."""
    maps, scored = {line["map"] for line in lines}, [line for line in lines if "ratio" in line]
    refused = maps - {line["map"] for line in scored}
    yield f"{len(maps)} maps, {len(refused)} refused: {' '.join(sorted(refused)) or 'none'}\n"
    yield "| learner | runs | median | worst | loses a start | CPU s, median | most |"
    yield "|---|---|---|---|---|---|---|"
    for learner in dict.fromkeys(line["learner"] for line in scored):
        group = [line for line in scored if line["learner"] == learner]
        ratios, cpu_s = [line["ratio"] for line in group], [line["cpu_s"] for line in group]
        lost = sum(line["reached"] < 1.0 for line in group)
        cells = [learner, str(len(group)), f"{median(ratios):.3f}", f"{max(ratios):.3f}", str(lost)]
        yield "| " + " | ".join([*cells, f"{median(cpu_s):.1f}", f"{max(cpu_s):.1f}"]) + " |"
    if scored:
        walk = [line["random"] for line in scored]
        yield f"| random walk | | {median(walk):.3f} | {max(walk):.3f} | | | |"
    below = sum(line["exact"] and line["ratio"] < 1.0 - 1e-9 for line in scored)
    yield f"\nbelow the optimum: {below}"


def span(text: str) -> list[str]:
    """``3000-3029`` as its numbers; a name as it is."""
    first, dash, last = text.partition("-")
    return [str(number) for number in range(int(first), int(last) + 1)] if dash else [text]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--maps", nargs="+", type=span, default=[["1"], ["2"], ["twin"]])
    parser.add_argument("--seeds", nargs="+", type=int, default=[0])
    parser.add_argument("--learners", nargs="+", choices=list(LEARNERS), default=["symbols", "last-2", "hmm-500"])
    parser.add_argument("--walks", type=int, default=20, help="walks from each cell, where chance has a part")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--out", type=Path, help="file for a line of JSON a run")
    options = parser.parse_args()
    names = [name for names in options.maps for name in names]
    jobs = [
        (name, learner, seed, options.walks) for name in names for learner in options.learners for seed in options.seeds
    ]
    with Pool(options.jobs) as pool:
        lines = list(pool.imap(run_one, jobs))
    print("\n".join(table(lines)))
    if options.out:
        options.out.write_text("".join(json.dumps(line) + "\n" for line in lines), encoding="utf-8")


if __name__ == "__main__":
    main()
