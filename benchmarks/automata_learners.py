"""Learners in ambiguous grid worlds on all kinds of states, most of them made of walk strings, over many seeds.

    python -m benchmarks.automata_learners --seeds 30 --jobs 2 --out runs/automata.csv

For each seed 1000 walks of at most 30 symbols, and 64 two-unit Elman networks on them. The states, all learned on with
equal settings in four runs each: the symbols; the last two; the last three; the inferred automaton; that of the same
network before it was trained, with the same q; that which is chosen in the same way from all 64 untrained networks; a
Markov chain from IoAlergia on the same strings, at two values of its eps; an acceptor from RPNI, which is also given as
many strings that no walk can give, made with knowledge of the map. Medians over all runs of the mean number of steps in
the last 100 of 1500 trials, and over seeds, which then count with the mean of their runs: 95 % bootstrap intervals of
the mean, and paired mean differences to the automaton. A run has converged in the trial after which the mean of 25
first comes to so many steps; compared with that of the learner on symbols alone, whose own final level the lowest of
these is. Walks and networks have seeds 300, 301, ..., learning 2200, 2201, ..., and 100 more for each further run; all
that settings were chosen with is below.
"""

from __future__ import annotations

import argparse
import csv
import warnings
from collections.abc import Iterator
from dataclasses import replace
from itertools import islice
from multiprocessing import Pool
from pathlib import Path
from typing import Any

import numpy as np
from aalpy.learning_algs import run_Alergia, run_RPNI

from palpate.adapters.config.grid import GridLearning
from palpate.adapters.experiments.grid.learning import StateMaker, learn
from palpate.adapters.experiments.grid.report import Score
from palpate.adapters.experiments.grid.worlds import Followed, Named, bounds_of, grid_named
from palpate.core.automata.elman import END, Network
from palpate.core.automata.infer import Inference, InferenceSettings, infer
from palpate.core.automata.machine import Kind, Machine
from palpate.core.automata.partition import bounded_partition
from palpate.core.automata.strings import Strings
from palpate.core.automata.training import TrainingSettings
from palpate.simulation.grid.maps import GridMap
from palpate.simulation.grid.trial import walk_strings

FIRST_SEED, LEARNING_SEED = 300, 2200
CONVERGED = {"1": (6.0, 5.0, 4.5, 4.0, 3.55), "2": (10.0, 8.0, 6.0), "twin": (10.0, 8.0, 6.0)}
"""Levels of the moving mean, by map."""
RUNS, NEXT_RUN = 4, 100
WINDOW = 25
ALERGIA_EPS = (0.05, 0.5)
"""AALpy's default, and one that merges fewer states; above 0.9 it finds hundreds of them and takes minutes."""
TRIALS = 1500
COLUMNS = ("map", "seed", "run", "states", "learner", "count", "last_100", "greedy_exact")
LEARNERS = {
    "Q-learning, backing off": GridLearning(),
    "Q-learning": GridLearning(back_off=0.0),
    "Sarsa": GridLearning(learner="sarsa"),
    "Sarsa, falling rate": GridLearning(learner="sarsa", alpha=0.2, alpha_visits=100.0, alpha_floor=0.03),
}


def alergia(strings: Strings, eps: float) -> Machine:
    """IoAlergia's Markov chain, as an automaton: the next symbol names the next state."""
    data = [["start", *(strings.alphabet[symbol] for symbol in word), END] for word in strings.words]
    model = run_Alergia(data, "mc", eps=eps)
    number = {state: place for place, state in enumerate(model.states)}
    rows = []
    for state in model.states:
        after = {target.output: number[target] for target, _ in state.transitions}
        rows.append(tuple(after.get(symbol) for symbol in strings.alphabet))
    return Machine(Kind.MOORE, strings.alphabet, tuple(rows), ("",) * len(rows), (), number[model.initial_state])


def possible(grid: GridMap, word: tuple[int, ...]) -> bool:
    """Whether a walk can give these readings and end at the goal."""
    places = {cell for cell in range(len(grid.cells)) if grid.readings[cell] == word[0]}
    for symbol in word[1:]:
        reached = {target for cell in places for target in grid.moves[cell] if target is not None}
        places = {cell for cell in reached if grid.readings[cell] == symbol}
    return any(None in grid.moves[cell] for cell in places)


def rpni(grid: GridMap, strings: Strings, seed: int) -> Machine:
    """RPNI's acceptor of walks, told from strings with one symbol changed so that no walk can give them."""
    rng = np.random.default_rng(seed)
    data: list[tuple[tuple[str, ...], bool]] = []
    for word in strings.words:
        data.append((tuple(strings.alphabet[symbol] for symbol in word), True))
        for _ in range(100):
            other = list(word)
            other[rng.integers(len(word))] = int(rng.integers(len(strings.alphabet)))
            if not possible(grid, tuple(other)):
                data.append((tuple(strings.alphabet[symbol] for symbol in other), False))
                break
    model = run_RPNI(data, "dfa", print_info=False)
    number = {state: place for place, state in enumerate(model.states)}
    rows = tuple(
        tuple(number.get(state.transitions.get(symbol)) for symbol in strings.alphabet) for state in model.states
    )
    accepted = tuple(bool(state.is_accepting) for state in model.states)
    return Machine(Kind.DFA, strings.alphabet, rows, accepted, (), number[model.initial_state])


def untrained_twin(found: Inference, untrained: Inference) -> Machine:
    """The automaton of the chosen network as it was before training, with the same q."""
    networks: dict[int, Network] = {one.restart: one.network for one in untrained.training.networks}
    cells = bounded_partition(networks[found.network.restart], found.chosen.intervals, by_symbol=True)
    return cells.minimal()


def states_of(name: str, seed: int) -> Iterator[tuple[str, StateMaker]]:
    """Kinds of state, as they are made for one seed, each when it is asked for."""
    grid = grid_named(name, 7)
    strings = walk_strings(grid, 1000, seed, 30)
    settings = InferenceSettings(training=TrainingSettings(seed=seed))
    found = infer(strings, settings)
    untrained = infer(strings, replace(settings, training=replace(settings.training, steps=0)))
    yield "symbols", Named()
    yield "last 2", Named("last-2")
    yield "last 3", Named("last-3")
    yield "automaton", Followed(found.machine, strings)
    yield "untrained, same q", Followed(untrained_twin(found, untrained), strings)
    yield "untrained, chosen", Followed(untrained.machine, strings)
    for eps in ALERGIA_EPS:
        yield f"IoAlergia, eps {eps}", Followed(alergia(strings, eps), strings)
    yield "RPNI", Followed(rpni(grid, strings, seed), strings)


def converged(steps: list[int], most: float) -> int:
    """Trials until the mean of a window first comes to ``most`` steps."""
    means = np.convolve(steps, np.ones(WINDOW) / WINDOW, "valid")
    below = np.flatnonzero(means <= most)
    return int(below[0]) + WINDOW if len(below) else len(steps)


def rows(job: tuple[str, int, int | None, int, str]) -> list[dict[str, Any]]:
    name, number, kinds, runs, only = job
    warnings.simplefilter("ignore")
    grid, done = grid_named(name, 7), []
    for kind, make in islice(states_of(name, FIRST_SEED + number), kinds):
        for learner in asked(only):
            for repeat in range(runs):
                run = learn(grid, make, LEARNERS[learner], LEARNING_SEED + number + NEXT_RUN * repeat, TRIALS)
                score = Score.of(grid, run)
                values = (
                    name, number, repeat, kind, learner, len(run.identifier.states), score.last, round(score.greedy, 4),
                )  # fmt: skip
                reached = {level_name(level): converged(run.steps, level) for level in CONVERGED[name]}
                done.append(dict(zip(COLUMNS, values, strict=True)) | reached)
    return done


def asked(only: str) -> list[str]:
    """Names of learners."""
    return [only] if only else list(LEARNERS)


def level_name(level: float) -> str:
    return f"to_{level:g}"


def column(table: list[dict[str, Any]], kind: str, learner: str, name: str) -> np.ndarray[Any, Any]:
    """For each seed the mean over its runs."""
    found: dict[int, list[float]] = {}
    for row in table:
        if (row["states"], row["learner"]) == (kind, learner):
            found.setdefault(row["seed"], []).append(row[name])
    return np.array([np.mean(found[seed]) for seed in sorted(found)])


def gap(ours: np.ndarray[Any, Any], theirs: np.ndarray[Any, Any], digits: int) -> str:
    """Mean of paired differences with its 95 % bootstrap interval."""
    differences = ours - theirs
    means = np.random.default_rng(0).choice(differences, size=(2000, len(differences))).mean(axis=1)
    low, high = np.quantile(means, (0.025, 0.975))
    return f"{differences.mean():+.{digits}f} ({low:+.{digits}f} to {high:+.{digits}f})"


def tell(name: str, table: list[dict[str, Any]], learners: list[str]) -> None:
    bounds = bounds_of(grid_named(name, 7))
    seeds = len({row["seed"] for row in table})
    print(f"map {name}, {seeds} seeds: full information {bounds.full:.2f}, belief-state optimum {bounds.belief:.2f}")
    for kind in dict.fromkeys(row["states"] for row in table):
        count = np.median(column(table, kind, learners[0], "count"))
        print(f"  {kind}, {count:.0f} states")
        for learner in learners:
            mine = [row for row in table if (row["states"], row["learner"]) == (kind, learner)]
            last = column(table, kind, learner, "last_100")
            means = np.random.default_rng(0).choice(last, size=(2000, len(last))).mean(axis=1)
            low, high = np.quantile(means, (0.025, 0.975))
            greedy = [row["greedy_exact"] for row in mine]
            median = np.median([row["last_100"] for row in mine])
            print(
                f"    {learner:23s} median {median:6.2f}, mean {last.mean():6.2f} "
                f"({low:.2f} to {high:.2f}); above the automaton "
                f"{gap(last, column(table, 'automaton', learner, 'last_100'), 2)}; "
                f"greedy {np.median(greedy):.2f}, least {min(greedy):.2f}"
            )
            for level in CONVERGED[name]:
                trials = column(table, kind, learner, level_name(level))
                symbols = column(table, "symbols", learner, level_name(level))
                median = np.median([row[level_name(level)] for row in mine])
                print(
                    f"      to {level:g} steps: median {median:.0f} trials, mean {trials.mean():.0f}; above symbols "
                    f"{gap(trials, symbols, 0)}"
                )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--maps", nargs="+", default=list(CONVERGED))
    parser.add_argument("--seeds", type=int, default=30)
    parser.add_argument("--first", type=int, default=0, help="how many seeds to leave out before them")
    parser.add_argument("--kinds", type=int, help="how many kinds of state, in the order above; all without it")
    parser.add_argument("--runs", type=int, default=RUNS, help="runs of learning a seed, at most 10")
    parser.add_argument("--learner", choices=LEARNERS, default="", help="only this one")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--out", type=Path, help="CSV file")
    options = parser.parse_args()
    levels = dict.fromkeys(level_name(level) for name in options.maps for level in CONVERGED[name])
    what = options.kinds, options.runs, options.learner
    numbers = range(options.first, options.first + options.seeds)
    columns, whole = (*COLUMNS, *levels), list[dict[str, Any]]()
    with Pool(options.jobs) as pool:
        for name in options.maps:
            table: list[dict[str, Any]] = []
            for done in pool.imap(rows, [(name, number, *what) for number in numbers]):
                table += done
                if options.out:
                    options.out.parent.mkdir(parents=True, exist_ok=True)
                    with options.out.open("w", newline="") as stream:
                        writer = csv.DictWriter(stream, columns, lineterminator="\n")
                        writer.writeheader()
                        writer.writerows(whole + table)
            whole += table
            tell(name, table, asked(options.learner))


if __name__ == "__main__":
    main()
