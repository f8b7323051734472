"""Learners with a memory on random grid maps, beside each other, against the exact optimum of the belief.

    python -m benchmarks.memory_maps run --out memory.jsonl --maps 3000-3029 --seeds 0 1 2 --jobs 1
    python -m benchmarks.memory_maps run --out noise.jsonl --maps 3000-3029 --seeds 0 --learners hmm-500 --slips 0.1
    python -m benchmarks.memory_maps table memory.jsonl

Maps of 5 x 5 to 11 x 11 cells, 3 to 8 symbols drawn for each cell alone, in two of five maps 12 % of walls; 1, 2 and
twin are those of the paper. Each run is one line of JSON, and a file that has it already is gone on with. A policy is
frozen and its steps are exact over all starts where nothing is left to chance (beliefs; tables of states, acting by
their final temperature, as a Markov chain); policies that draw, and worlds that do, are walked. The ratio is to the
exact optimum without disturbance, of steps that are cut off at 100, as trials are; what does not reach the goal is
counted beside it; maps whose optimum takes more than two million cells are refused, and counted.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import lru_cache
from multiprocessing import Pool
from pathlib import Path
from statistics import median
from time import process_time
from typing import Any

import numpy as np

from palpate.adapters.config import GridLearning
from palpate.adapters.experiments.grid import LearningRun, Named, bounds_of, grid_named, learn
from palpate.core.errors import ConfigurationError
from palpate.core.policy import TabularLearner, boltzmann_probabilities
from palpate.core.policy.hmm import PATIENCE
from palpate.simulation.grid import (
    GOAL,
    SCENARIOS,
    UNDISTURBED,
    WALL,
    Disturbance,
    ExpectedSteps,
    GridMap,
    expected_steps,
    walked_steps,
)

LETTERS = "ABCDEFGH"
Q_FROM_0 = GridLearning()
LEARNERS: dict[str, tuple[str, GridLearning, int]] = {
    "symbols": ("symbols", Q_FROM_0, 500),
    "last-2": ("last-2", Q_FROM_0, 500),
    "last-3": ("last-3", Q_FROM_0, 500),
    "hmm-100": ("symbols", replace(Q_FROM_0, learner="hmm"), 100),
    "hmm-500": ("symbols", replace(Q_FROM_0, learner="hmm"), 500),
    "hmm-1500": ("symbols", replace(Q_FROM_0, learner="hmm"), 1500),
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


def map_of(name: str) -> GridMap:
    """A map of the paper, or a random one by its seed; 2 alone is the paper's."""
    return grid_named(name, 7) if name in SCENARIOS else random_map(int(name))


@lru_cache(maxsize=4)
def facts(name: str) -> dict[str, Any]:
    """What a map is, and what is possible there."""
    grid = map_of(name)
    bounds = bounds_of(grid)
    shape = {"rows": list(grid.rows), "cells": len(grid.cells), "symbols": len(grid.symbols)}
    return shape | {"optimum": bounds.belief, "omniscient": bounds.full, "random": bounds.random_walk}


def in_use(run: LearningRun) -> Any:
    """The learned policy, ready to act: fitted to the last trials too, and planned."""
    if isinstance(run.learner, TabularLearner):
        run.learner.frozen = True
        return run.learner
    policy = run.learner.as_frozen()
    policy.begin_trial(0, np.random.default_rng(0))
    return policy


def frozen(
    grid: GridMap, run: LearningRun, policy_now: Any, disturbance: Disturbance, walks: int
) -> tuple[ExpectedSteps, bool]:
    """What the learned policy costs, acting as it would in use, and whether that is exact."""
    if isinstance(policy_now, TabularLearner) and disturbance == UNDISTURBED:
        heat = policy_now.parameters.temperature.when_frozen
        policy = [boltzmann_probabilities(values, heat) for values in policy_now.q]
        return expected_steps(grid, run.identifier, policy), True
    sure = PATIENCE if disturbance == UNDISTURBED and policy_now.temperature is None else 0
    if sure:
        found = walked_steps(grid, run.identifier, policy_now, sure, seed=1)
        if found.reaches_in_time == 1.0:
            return found, True
    found = walked_steps(
        grid, run.identifier, policy_now, walks=walks, sure_steps=sure, seed=1, disturbance=disturbance
    )
    return found, False


def run_one(job: tuple[str, str, int, Disturbance, int]) -> dict[str, Any]:
    """One learning run, as a line of the file."""
    name, learner, seed, disturbance, walks = job
    line: dict[str, Any] = {"map": name, "learner": learner, "seed": seed}
    line |= {"slips": disturbance.slips, "misreads": disturbance.misreads} | facts(name)
    if line["optimum"] is None:
        return line
    grid = map_of(name)
    states, settings, trials = LEARNERS[learner]
    began = process_time()
    run = learn(grid, Named(states), settings, seed, trials, disturbance=disturbance)
    policy = in_use(run)
    line["cpu_s"] = round(process_time() - began, 2)
    found, exact = frozen(grid, run, policy, disturbance, walks)
    line |= {
        "steps": found.steps,
        "reaches": found.reaches,
        "exact": exact,
        "last_100": float(np.mean(run.steps[-100:])),
    }
    return line | {"ratio": found.limited_steps / line["optimum"]}


def jobs(options: argparse.Namespace, done: set[str]) -> Iterator[tuple[str, str, int, Disturbance, int]]:
    """The runs that are still to be done, map by map, so that an optimum is found once."""
    disturbance = Disturbance(options.slips, options.misreads)
    for name in options.maps:
        for learner in options.learners:
            for seed in options.seeds:
                if key_of({"map": name, "learner": learner, "seed": seed, **vars_of(disturbance)}) not in done:
                    yield name, learner, seed, disturbance, options.walks


def vars_of(disturbance: Disturbance) -> dict[str, float]:
    return {"slips": disturbance.slips, "misreads": disturbance.misreads}


def key_of(line: dict[str, Any]) -> str:
    return json.dumps([line[name] for name in ("map", "learner", "seed", "slips", "misreads")])


def lines_of(path: Path) -> list[dict[str, Any]]:
    """The whole lines of a file; a half one, where a run was cut off, is left out."""
    if not path.exists():
        return []
    return [
        json.loads(text) for text in path.read_text(encoding="utf-8").splitlines(keepends=True) if text.endswith("\n")
    ]


def run(options: argparse.Namespace) -> None:
    path = Path(options.out)
    lines = lines_of(path)
    path.write_text("".join(json.dumps(line) + "\n" for line in lines), encoding="utf-8")
    waiting = list(jobs(options, set(map(key_of, lines))))
    with Pool(options.jobs) as pool, path.open("a", encoding="utf-8") as file:
        for number, line in enumerate(pool.imap(run_one, waiting), 1):
            file.write(json.dumps(line) + "\n")
            file.flush()
            told = f"{line['ratio']:.3f}, {line['cpu_s']:.1f} CPU s" if "ratio" in line else "optimum not found"
            print(
                f"{number}/{len(waiting)} map {line['map']} {line['learner']} seed {line['seed']}: {told}", flush=True
            )


def table(options: argparse.Namespace) -> None:
    """A line for each learner: median and worst ratio, the share below last-2, those that lose a start."""
    lines = [line for path in options.files for line in lines_of(Path(path))]
    maps = {line["map"]: line for line in lines}
    refused = [name for name, line in maps.items() if line["optimum"] is None]
    print(f"{len(maps)} maps, {len(refused)} refused: {' '.join(refused) or 'none'}\n")
    print("| learner | slips | misreads | runs | median | worst | loses a start | CPU s, median | most |")
    print("|---|---|---|---|---|---|---|---|---|")
    scored = [line for line in lines if "ratio" in line]
    groups: dict[tuple[str, float, float], list[dict[str, Any]]] = {}
    for line in scored:
        groups.setdefault((line["learner"], line["slips"], line["misreads"]), []).append(line)
    for (learner, slips, misreads), group in groups.items():
        ratios, cpu = [line["ratio"] for line in group], [line["cpu_s"] for line in group]
        lost = sum(line["reaches"] < 1.0 for line in group)
        cells = [learner, f"{slips:g}", f"{misreads:g}", str(len(group)), f"{median(ratios):.3f}", f"{max(ratios):.3f}"]
        print("| " + " | ".join([*cells, str(lost), f"{median(cpu):.1f}", f"{max(cpu):.1f}"]) + " |")
    known: list[tuple[str, Callable[[dict[str, Any]], float]]] = [
        ("omniscient", lambda line: line["omniscient"] / line["optimum"]),
        ("random walk", lambda line: line["random"] / line["optimum"]),
    ]
    for who, ratio in known:
        ratios = [ratio(line) for line in maps.values() if line["optimum"] is not None]
        if ratios:
            print(f"| {who} | | | {len(ratios)} | {median(ratios):.3f} | {max(ratios):.3f} | | | |")
    below = [line for line in scored if line["ratio"] < 1.0 - 1e-9 and line["exact"]]
    print(f"\nbelow the optimum: {len(below)}")


def span(text: str) -> list[str]:
    """``3000-3029`` as its numbers; a name as it is."""
    first, dash, last = text.partition("-")
    return [str(number) for number in range(int(first), int(last) + 1)] if dash else [text]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(required=True)
    runs = commands.add_parser("run")
    runs.add_argument("--out", required=True)
    runs.add_argument("--maps", nargs="+", type=span, default=[["1"], ["2"], ["twin"]])
    runs.add_argument("--seeds", nargs="+", type=int, default=[0])
    runs.add_argument(
        "--learners",
        nargs="+",
        choices=list(LEARNERS),
        default=[name for name in LEARNERS if not name.endswith("-1500")],
    )
    runs.add_argument("--slips", type=float, default=0.0)
    runs.add_argument("--misreads", type=float, default=0.0)
    runs.add_argument("--walks", type=int, default=100, help="walks from each start, where chance has a part")
    runs.add_argument("--jobs", type=int, default=1)
    runs.set_defaults(do=run)
    tables = commands.add_parser("table")
    tables.add_argument("files", nargs="+")
    tables.set_defaults(do=table)
    options = parser.parse_args()
    if "maps" in options:
        options.maps = [name for names in options.maps for name in names]
    options.do(options)


if __name__ == "__main__":
    main()
