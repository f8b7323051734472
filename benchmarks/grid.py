"""Learning in ambiguous grid worlds, over many seeds, held against what is possible at all.

    python -m benchmarks.grid --seeds 30 --jobs 2 --out runs/grid

A line for each kind of state and learner on each map: mean and median over seeds of the mean number of steps in the
last 100 of 1500 trials, with bootstrap intervals (95 %), and the exact cost of the greedy policy that was learned.
Then, for symbols only, the best action of each symbol over seeds. "Hot" are the settings that were best for symbols
only in scenario 2, where nothing but chance leads out of circles; other Q-learning has a constant rate of 0.2.
The seeds are 100, 101, ...: none of them was used
while settings were chosen (those were 0, 1 and 2). Equal seeds give equal tables, whatever the number of processes.
"""

from __future__ import annotations

import argparse
import csv
import json
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import lru_cache
from itertools import product
from multiprocessing import Pool
from pathlib import Path
from typing import Final

import numpy as np

from palpate.adapters.config.grid import GridLearning
from palpate.adapters.experiments.grid.learning import learn
from palpate.adapters.experiments.grid.report import Score
from palpate.adapters.experiments.grid.worlds import Named, bounds_of, grid_named
from palpate.adapters.experiments.statistics import mean_with_interval, quantile_interval
from palpate.core.errors import ConfigurationError
from palpate.core.perception import IdentityState
from palpate.core.policy.base import COMPASS_NAMES
from palpate.simulation.grid.chain import STEP_LIMIT, ExpectedSteps, expected_steps
from palpate.simulation.grid.maps import COMPASS, GridMap

FIRST_SEED = 100
MAPS = ("1", "2", "twin")


MOST_SYMBOLS: Final = 6
"""With a seventh there would be two million policies to try."""


def best_actions(grid: GridMap) -> tuple[tuple[int, ...], ...]:
    """For each symbol the actions that shorten the way from every cell with that symbol, (symbols, any number).

    Where there are none, no action is the right one for the symbol, and a policy with no other input must
    fail somewhere (paper, section 4).
    """
    distances = grid.distances
    shared = [set(range(len(COMPASS))) for _ in grid.symbols]
    for cell, targets in enumerate(grid.moves):
        nearer = {action for action, target in enumerate(targets) if distances[target] < distances[cell]}
        shared[grid.readings[cell]] &= nearer
    return tuple(tuple(sorted(actions)) for actions in shared)


@lru_cache(maxsize=16)
def best_fixed_actions(grid: GridMap, step_limit: int = STEP_LIMIT) -> ExpectedSteps:
    """The best policy that always takes the same action for a symbol, by trying every one of them.

    It bounds all policies that have no memory and draw nothing.

    Args:
        grid: The map.
        step_limit: Steps after which a trial is cut off; the best policy is the one with the fewest steps so.

    Raises:
        ConfigurationError: The map has too many symbols.
    """
    count = len(grid.symbols)
    if count > MOST_SYMBOLS:
        raise ConfigurationError("grid.map", f"{count} symbols", f"at most {MOST_SYMBOLS}, to try all policies")
    policies = np.array(list(product(range(len(COMPASS)), repeat=count)), dtype=np.int8)
    goal = len(grid.cells)
    targets = [[goal if target is None else target for target in row] for row in grid.moves]
    moves, readings = np.array(targets, dtype=np.int16), np.array(grid.readings)
    total = np.zeros(len(policies), dtype=np.int64)
    for start in range(goal):
        running, cells = np.arange(len(policies)), np.full(len(policies), start, dtype=np.int16)
        # Who has not arrived after as many steps as there are cells goes round in circles.
        for _ in range(min(step_limit, goal)):
            total[running] += 1
            cells = moves[cells, policies[running, readings[cells]]]
            running, cells = running[cells != goal], cells[cells != goal]
        total[running] += max(0, step_limit - goal)
    best = policies[int(np.argmin(total))]
    policy = [[float(index == action) for index in range(len(COMPASS))] for action in best]
    return expected_steps(grid, IdentityState(grid.symbols), policy, step_limit)


@dataclass(frozen=True)
class Contender:
    """A kind of state, and a learner with its settings."""

    name: str
    state: str
    learning: GridLearning = field(default_factory=GridLearning)


CONSTANT = GridLearning(alpha=0.2, temperature=1.0, back_off=0.0)
SARSA = GridLearning(learner="sarsa", temperature=1.0)
# What was best for symbols alone in the second scenario and its twin: there only dice lead out of circles.
HOT_Q = GridLearning(alpha=0.05, temperature=3.0, temperature_decay=0.995, temperature_floor=1.0, back_off=0.0)
HOT_SARSA = GridLearning(
    learner="sarsa", alpha=0.05, temperature=1.5, temperature_decay=1.0, temperature_floor=1.5, trace_decay=0.95
)
CONTENDERS = (
    Contender("symbols, Q-learning", "symbols", CONSTANT),
    Contender("symbols, Q-learning, hot", "symbols", HOT_Q),
    Contender("symbols, Sarsa", "symbols", SARSA),
    Contender("symbols, Sarsa, hot", "symbols", HOT_SARSA),
    Contender("last 2, Q-learning", "last-2", CONSTANT),
    Contender("last 2, Sarsa", "last-2", SARSA),
    Contender("last 3, Q-learning", "last-3", CONSTANT),
    Contender("last 3, Sarsa", "last-3", SARSA),
)


@dataclass(frozen=True)
class Result:
    score: Score
    best: tuple[int, ...]
    """Best action of each state."""


def run(job: tuple[str, int, Contender, int, int]) -> Result:
    name, size, contender, seed, trials = job
    grid = grid_named(name, size)
    done = learn(grid, Named(contender.state), contender.learning, seed, trials)
    best = tuple(values.index(max(values)) for values in done.learner.q)
    return Result(Score.of(grid, done, contender.learning.step_limit), best)


def line(scores: list[Score]) -> dict[str, object]:
    last = [score.last for score in scores]
    return {
        "mean": round(float(np.mean(last)), 3),
        "mean_95": [None if v is None else round(v, 3) for v in mean_with_interval(last)[1:]],
        "median": round(float(np.median(last)), 3),
        "median_95": [round(v, 3) for v in quantile_interval(last, 0.5) or ()],
        "min_max": [min(last), max(last)],
        "first_100": round(float(np.mean([score.first for score in scores])), 2),
        "goal_reached": round(float(np.mean([score.reached for score in scores])), 4),
        "greedy_exact": round(float(np.mean([score.greedy for score in scores])), 2),
    }


def agreement(grid: GridMap, results: list[Result]) -> Iterator[str]:
    """How often the seeds agree on the best action of a symbol, beside those that are right in all its cells."""
    for state, (symbol, right) in enumerate(zip(grid.symbols, best_actions(grid), strict=True)):
        counts = Counter(COMPASS_NAMES[result.best[state]] for result in results).most_common(3)
        shown = ", ".join(f"{action} {count / len(results):.0%}" for action, count in counts)
        names = " or ".join(COMPASS_NAMES[action] for action in right) or "none"
        yield f"    {symbol} (right in all {grid.readings.count(state)} cells: {names}): {shown}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--maps", nargs="+", default=list(MAPS))
    parser.add_argument("--size", type=int, default=7)
    parser.add_argument("--seeds", type=int, default=30)
    parser.add_argument("--first-seed", type=int, default=FIRST_SEED)
    parser.add_argument("--trials", type=int, default=1500)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--out", type=Path, help="folder for grid.json and grid.csv")
    options = parser.parse_args()
    seeds = range(options.first_seed, options.first_seed + options.seeds)
    tables: dict[str, object] = {}
    rows: list[list[object]] = []
    with Pool(options.jobs) as pool:
        for name in options.maps:
            grid = grid_named(name, options.size)
            bounds, fixed = bounds_of(grid), best_fixed_actions(grid)
            print(
                f"map {name}, {options.size} x {options.size}, seeds {seeds[0]} to {seeds[-1]}, {options.trials} trials"
            )
            table: dict[str, object] = {
                "full_information": bounds.full,
                "belief_optimum": bounds.belief,
                "random_walk": bounds.random_walk,
                "best_fixed_actions": fixed.limited_steps,
            }
            for key, value in table.items():
                print(f"  {key.replace('_', ' '):24s} {value:8.2f}  (exact)")
            agreed = []
            for contender in CONTENDERS:
                jobs = [(name, options.size, contender, seed, options.trials) for seed in seeds]
                results = list(pool.imap(run, jobs))
                done = line([result.score for result in results])
                table[contender.name] = done
                rows += [[name, contender.name, r.score.seed, r.score.last, r.score.greedy] for r in results]
                print(
                    f"  {contender.name:24s} {done['mean']:8.2f} {done['mean_95']}, median {done['median']} "
                    f"{done['median_95']}, greedy {done['greedy_exact']}, goal {done['goal_reached']:.1%}",
                    flush=True,
                )
                if contender.state == "symbols":
                    agreed += [f"  best actions, {contender.name}:", *agreement(grid, results)]
            tables[name] = table
            print("\n".join(agreed) + "\n", flush=True)
    if options.out:
        options.out.mkdir(parents=True, exist_ok=True)
        (options.out / "grid.json").write_text(json.dumps(tables, indent=1) + "\n")
        with (options.out / "grid.csv").open("w", newline="") as stream:
            writer = csv.writer(stream, lineterminator="\n")
            writer.writerow(["map", "contender", "seed", "last_100", "greedy_exact"])
            writer.writerows(rows)


if __name__ == "__main__":
    main()
