"""Automata with actions on random maps that nobody chose: what a frozen policy on their states costs, beside others'.

    python -m benchmarks.automaton_maps --maps 30 --first-map 3000 --seeds 3 --jobs 2 --out runs/automaton_maps.csv

Maps of 5 x 5 to 11 x 11 cells with 3 to 8 symbols in patches, two in five with walls; those whose exact optimum is
not found within the bound are refused, and their number is told. A run is 500 trials of at most 100 steps: 120 random
walks, then trials by a plan that is made anew every tenth and a tenth of whose actions are random. After 120, 220
and 340 trials an automaton is inferred from all of them as strings of actions and symbols (first-order networks). The
plan is value iteration on how often its states led to which, backing off to the last symbol, and the policy draws by a
soft minimum, which leads out of circles; how soft, the last 100 trials choose. All kinds of state have the same planner
and policy: the last symbol, the last two, the last three, the last two pairs of action and symbol, the automaton of
untrained networks, the automaton. The cost of the last policy, which learns no more, is exact, over all starts; told as
a ratio to the optimum of the belief. What is in the file already is not run again. Settings were chosen on map seeds
below 1000.

With ``--nulls``: held-out loss on shuffled strings beside that of the last symbol, on two maps, and the ratio on a map
where every symbol says where it is; nothing is to be gained there.
"""

from __future__ import annotations

import argparse
import csv
from collections.abc import Callable, Sequence
from multiprocessing import Pool
from pathlib import Path
from statistics import median
from time import process_time
from typing import Any

import numpy as np

from palpate.core.automata import AutomatonState, Inference, InferenceSettings, Strings, TrainingSettings, infer
from palpate.core.automata.choice import ExtractionSettings, last_letters
from palpate.core.automata.prefix_tree import PrefixTree
from palpate.core.errors import ConfigurationError
from palpate.core.perception import IdentityState, LastSymbols, StateIdentifier
from palpate.core.policy import COMPASS_NAMES
from palpate.simulation.grid import STEP_LIMIT, GridMap, Walk, belief_optimum, expected_steps, strings_of_walks
from palpate.simulation.grid.trial import Walker

TRIALS = (120, 220, 340, 500)
"""Trials after which states are inferred; the first are random walks, and after the last the policy is frozen."""
SOFTNESS, JUDGED = (0.1, 0.2, 0.3, 0.5, 0.8), 100
"""In steps; the first of equals is taken, and so many of the last trials judge them."""
PLAN_EVERY, EXPLORE = 10, 0.1
DISCOUNT, BACK_OFF, PESSIMISM = 0.98, 2.0, 60.0
KINDS = ("symbols", "last-2", "last-3", "last-2 pairs", "untrained", "automaton")
COLUMNS = ("map", "seed", "kind", "optimum", "steps", "ratio", "reaches", "states", "loss", "best_beside", "cpu_s")

Floats = np.ndarray[Any, np.dtype[np.float64]]


def random_map(seed: int) -> tuple[GridMap | None, float]:
    """A map and its optimum; None where that takes too long."""
    rng = np.random.default_rng([20, seed])
    while True:
        width, height = rng.integers(5, 12, 2).tolist()
        count = int(rng.integers(3, 9))
        patches = int(rng.integers(count, 2 * count + 1))
        middles = rng.random((patches, 2)) * (width, height)
        symbols = np.concatenate((np.arange(count), rng.integers(0, count, patches - count)))
        x, y = np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5)
        nearest = ((x[..., None] - middles[:, 0]) ** 2 + (y[..., None] - middles[:, 1]) ** 2).argmin(axis=-1)
        letters = np.array(list("ABCDEFGH"))[symbols[nearest]]
        if rng.random() < 0.4:
            letters[rng.random(letters.shape) < 0.1] = "#"
        letters[rng.integers(height), rng.integers(width)] = "."
        try:
            grid = GridMap(tuple("".join(row) for row in letters))
        except ConfigurationError:  # a cell without a way to the goal
            continue
        if len(grid.symbols) < 3:
            continue
        try:
            return grid, float(belief_optimum(grid))
        except ConfigurationError:
            return None, 0.0


def inferred(strings: Strings, seed: int, steps: int) -> Inference:
    training = TrainingSettings(restarts=8, batch=8, steps=steps, seed=seed)
    extraction = ExtractionSettings(most_intervals=5, most_states=600)
    return infer(strings, InferenceSettings(order=1, finalists=2, training=training, extraction=extraction))


class Planner:
    """How often states led to which, and the plan on that."""

    def __init__(self, identifier: StateIdentifier) -> None:
        self.identifier, states = identifier, len(identifier.states)
        self._counts = np.zeros((states, len(COMPASS_NAMES), states + 1))
        self._cost = np.full(states + 1, PESSIMISM / 2.0)
        self._cost[-1] = 0.0
        known = [-1 if symbol is None else symbol for symbol in identifier.symbol_of]
        self._shares = np.eye(len(identifier.symbols) + 1)[known].T

    def count(self, walk: Walk) -> None:
        """Take in a trial."""
        identifier = self.identifier
        identifier.reset()
        state = identifier.update(walk.symbols[0])
        for action, symbol in zip(walk.actions, walk.symbols[1:], strict=False):
            after = identifier.update(symbol, COMPASS_NAMES[action])
            self._counts[state, action, after] += 1.0
            state = after
        if walk.reached:
            self._counts[state, walk.actions[-1], -1] += 1.0

    def costs(self) -> Floats:
        """Expected steps by state and action, (states, actions)."""
        tried = self._counts.sum(axis=2)
        by_symbol = self._shares @ tried
        for _ in range(200):
            own = tried + DISCOUNT * (self._counts @ self._cost)
            pooled = (self._shares @ own + PESSIMISM) / (by_symbol + 1.0)
            costs = (own + BACK_OFF * (self._shares.T @ pooled)) / (tried + BACK_OFF)
            before, self._cost[:-1] = self._cost[:-1].copy(), costs.min(axis=1)
            if np.abs(self._cost[:-1] - before).max() < 1e-4:
                break
        return costs


def soft(costs: Floats, softness: float) -> Floats:
    """Probability of each action in each state, (states, actions)."""
    weights = np.exp((costs.min(axis=1, keepdims=True) - costs) / softness)
    shares: Floats = weights / weights.sum(axis=1, keepdims=True)
    return shares


def walked(grid: GridMap, identifier: StateIdentifier, policy: Floats, seed: int, trial: int, explore: float) -> Walk:
    """A trial."""
    rng, walker = np.random.default_rng([seed, trial]), Walker(grid, identifier, seed, trial)
    while walker.cell is not None and walker.steps < STEP_LIMIT:
        random = rng.random() < explore
        walker.move(
            int(rng.integers(len(COMPASS_NAMES)) if random else rng.choice(policy.shape[1], p=policy[walker.state]))
        )
    return walker.walk


def states_of(kind: str, grid: GridMap, walks: Sequence[Walk], seed: int) -> tuple[StateIdentifier, float, float]:
    """States of a kind, and what they and the best of the last one to three pairs lose on held-out strings, if told."""
    if kind == "symbols":
        return IdentityState(grid.symbols), 0.0, 0.0
    if not kind.endswith("pairs") and kind.startswith("last-"):
        return LastSymbols(grid.symbols, int(kind[-1])), 0.0, 0.0
    strings = strings_of_walks(grid, walks)
    if kind == "last-2 pairs":
        tree = PrefixTree.of(strings)
        return AutomatonState.of(last_letters(tree, 2, strings.actions), tree), 0.0, 0.0
    found = inferred(strings, seed, 0 if kind == "untrained" else 120)
    return AutomatonState.of(found.machine, strings), found.chosen.loss or 0.0, min(found.beside.values())


def learned(kind: str, grid: GridMap, seed: int) -> tuple[StateIdentifier, Floats, float, float]:
    """What 500 trials come to: states and policy, and what :func:`states_of` says of them."""
    everywhere = IdentityState(grid.symbols)
    by_chance = np.full((len(grid.symbols), len(COMPASS_NAMES)), 1.0 / len(COMPASS_NAMES))
    walks = [walked(grid, everywhere, by_chance, seed, trial, 0.0) for trial in range(TRIALS[0])]
    took: list[list[int]] = [[] for _ in SOFTNESS]
    for end in TRIALS[1:]:
        identifier, loss, beside = states_of(kind, grid, walks, seed)
        planner = Planner(identifier)
        for walk in walks:
            planner.count(walk)
        costs = planner.costs()
        while len(walks) < end:
            trial = len(walks)
            place, judged = trial % len(SOFTNESS), trial >= TRIALS[-1] - JUDGED
            policy = soft(costs, SOFTNESS[place] if judged else 0.2)
            walks.append(walked(grid, identifier, policy, seed, trial, 0.0 if judged else EXPLORE))
            planner.count(walks[-1])
            if judged:
                took[place].append(walks[-1].steps)
            if len(walks) % PLAN_EVERY == 0:
                costs = planner.costs()
    best = min(range(len(SOFTNESS)), key=lambda place: sum(took[place]))
    return identifier, soft(costs, SOFTNESS[best]), loss, beside


def run(job: tuple[int, int, str, GridMap, float]) -> dict[str, Any]:
    number, seed, kind, grid, optimum = job
    began = process_time()
    identifier, policy, loss, beside = learned(kind, grid, seed)
    cpu_s = process_time() - began
    cost = expected_steps(grid, identifier, policy.tolist())
    values = (number, seed, kind, round(optimum, 4), round(cost.steps, 4), round(cost.steps / optimum, 4),
              round(cost.reaches_in_time, 6), len(identifier.states), round(loss, 4), round(beside, 4),
              round(cpu_s, 1))  # fmt: skip
    return dict(zip(COLUMNS, values, strict=True))


def nulls() -> None:
    for number in (0, 1):
        grid, _ = random_map(number)
        if grid is None:
            continue
        everywhere, by_chance = IdentityState(grid.symbols), np.full((len(grid.symbols), 8), 0.125)
        strings = strings_of_walks(grid, [walked(grid, everywhere, by_chance, 0, trial, 0.0) for trial in range(200)])
        letters = iter(
            np.random.default_rng(0).permutation([one for word in strings.words for one in word[1:]]).tolist()
        )
        words = tuple((word[0], *(next(letters) for _ in word[1:])) for word in strings.words)
        tests: dict[str, Callable[[], Inference]] = {
            "as walked": lambda strings=strings: inferred(strings, 0, 120),
            "untrained": lambda strings=strings: inferred(strings, 0, 0),
            "shuffled": lambda strings=strings, words=words: inferred(
                Strings(strings.alphabet, words, actions=strings.actions, ends=strings.ends), 0, 120
            ),
        }
        for name, make in tests.items():
            found = make()
            beside = ", ".join(f"{who} {loss:.4f}" for who, loss in found.beside.items())
            print(f"map {number}, {name:9s}: automaton {found.chosen.loss:.4f} nats a symbol; {beside}", flush=True)
    grid = GridMap.from_regions("ABC/D.E/FGH")
    for kind in ("symbols", "automaton"):
        print(
            f"every symbol says where it is, {kind}: {run((-1, 0, kind, grid, float(belief_optimum(grid))))}",
            flush=True,
        )


def tell(rows: Sequence[dict[str, Any]]) -> None:
    for kind in KINDS:
        mine = [row for row in rows if row["kind"] == kind]
        if mine:
            ratios, cpu = [float(row["ratio"]) for row in mine], [float(row["cpu_s"]) for row in mine]
            least = min(float(row["reaches"]) for row in mine)
            print(f"{kind:13s} {len(mine):3d} runs: median {median(ratios):.3f}, worst {max(ratios):.2f}, ", end="")
            print(f"least {min(ratios):.3f}; goal within {STEP_LIMIT} steps {least:.4f} or more; ", end="")
            print(f"CPU {median(cpu):.1f} s, at most {max(cpu):.1f} s")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--maps", type=int, default=5)
    parser.add_argument("--first-map", type=int, default=0)
    parser.add_argument("--seeds", type=int, default=1)
    parser.add_argument("--kinds", nargs="+", default=list(KINDS), choices=KINDS)
    parser.add_argument("--nulls", action="store_true", help="these instead")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--out", type=Path, default=Path("runs/automaton_maps.csv"))
    options = parser.parse_args()
    if options.nulls:
        nulls()
        return
    options.out.parent.mkdir(parents=True, exist_ok=True)
    rows: list[dict[str, Any]] = []
    if options.out.exists():
        with options.out.open(newline="") as stream:
            rows = list(csv.DictReader(stream))
    done = {(int(row["map"]), int(row["seed"]), row["kind"]) for row in rows}
    jobs, refused = [], 0
    for number in range(options.first_map, options.first_map + options.maps):
        grid, optimum = random_map(number)
        if grid is None:
            refused += 1
            continue
        for seed in range(options.seeds):
            jobs += [(number, seed, kind, grid, optimum) for kind in options.kinds if (number, seed, kind) not in done]
    with Pool(options.jobs) as pool, options.out.open("a", newline="") as stream:
        writer = csv.DictWriter(stream, COLUMNS, lineterminator="\n")
        if not rows:
            writer.writeheader()
        for row in pool.imap_unordered(run, jobs):
            writer.writerow(row)
            stream.flush()
            rows.append(row)
            print(", ".join(f"{name} {value}" for name, value in row.items()), flush=True)
    print(f"{refused} maps refused: their optimum takes too long")
    tell(rows)


if __name__ == "__main__":
    main()
