"""Automata with actions on random maps that nobody chose: what a frozen policy on their states costs, beside others'.

    python -m benchmarks.automaton_maps --maps 3000-3029 --seeds 3 --jobs 2 --out runs/automaton_maps.csv

The maps are those of benchmarks/memory_maps.py, of 5 x 5 to 11 x 11 cells with 3 to 8 symbols; those whose exact
optimum is not found within the bound are refused, and their number is told. A run is 500 trials of at most 100 steps:
random walks, then trials by a plan that is made anew every so often and a tenth of whose actions are random. After
some of the trials an automaton is inferred from all of them as strings of actions and symbols: second-order networks
with a normalised hidden layer, a partition of the hidden space, minimisation, the choice of q by held-out log-loss. The
plan is value iteration on how often its states led to which, and the policy draws by a soft minimum, which leads out of
circles; how soft, the last 100 trials choose. Beforehand each state and action counts as tried a few times, with what
the network predicts there. All kinds of state have the same planner and policy, without that, and back off to the last
symbol: the last symbol, the last two, the last three, the last two pairs of action and symbol, the automaton of
untrained networks, the automaton. The cost of the last policy, which learns no more, is exact, over all starts; told as
a ratio to the optimum of the belief. What is in the file already is not run again. Settings were chosen on
map 101, with a look at 102 and 103.

With ``--nulls``: held-out loss on shuffled strings beside that of the last symbol, on two maps, and the ratio on a map
where every symbol says where it is; nothing is to be gained there.
"""

from __future__ import annotations

import argparse
import csv
from collections.abc import Callable, Sequence
from itertools import product
from multiprocessing import Pool
from pathlib import Path
from statistics import median
from time import process_time
from typing import Any

import numpy as np
from scipy.sparse import csr_array

from benchmarks.memory_maps import facts, map_of, span
from palpate.core.automata import AutomatonState, Inference, InferenceSettings, Strings, TrainingSettings, infer
from palpate.core.automata.choice import ExtractionSettings, last_letters
from palpate.core.automata.elman import NORMALISED
from palpate.core.automata.prefix_tree import PrefixTree
from palpate.core.perception import IdentityState, LastSymbols, StateIdentifier
from palpate.core.policy import COMPASS_NAMES
from palpate.simulation.grid import STEP_LIMIT, GridMap, Walk, belief_optimum, expected_steps, strings_of_walks
from palpate.simulation.grid.trial import Walker

TRIALS = (120, 220, 350, 500)
"""Trials after which states are inferred; the first are random walks, and after the last the policy is frozen."""
SOFTNESS, JUDGED = (0.1, 0.2, 0.3, 0.5, 0.8), 100
"""In steps; the first of equals is taken, and so many of the last trials judge them."""
PLAN_EVERY, EXPLORE = 10, 0.1
DISCOUNT, BACK_OFF, PESSIMISM = 0.98, 2.0, 60.0
UNITS, STEPS, LONGEST, FORETOLD = 80, 100, 60, 20.0
"""Hidden units, about, as many for each symbol; steps of training; longest string; visits a prediction is worth."""
KINDS = ("symbols", "last-2", "last-3", "last-2 pairs", "untrained", "automaton")
COLUMNS = ("map", "seed", "kind", "optimum", "steps", "ratio", "reaches", "states", "loss", "best_beside", "cpu_s")

Floats = np.ndarray[Any, np.dtype[np.float64]]


def inferred(strings: Strings, seed: int, steps: int) -> Inference:
    training = TrainingSettings(
        restarts=2, batch=2, steps=steps, learning_rate=0.6, clip=100.0, flat_looks=1, seed=seed
    )
    extraction = ExtractionSettings(fewest_intervals=3, most_intervals=4, most_states=1000)
    hidden = len(strings.names) * round(UNITS / len(strings.names))
    settings = InferenceSettings(
        activation=NORMALISED, hidden=hidden, finalists=1, training=training, extraction=extraction
    )
    return infer(strings, settings)


class Planner:
    """How often states led to which, and the plan on that.

    Args:
        foretold: Visits of each state and action that count beforehand, by where they lead, goal last; 0 for none.
    """

    def __init__(self, identifier: StateIdentifier, foretold: Floats | float = 0.0) -> None:
        self.identifier, states = identifier, len(identifier.states)
        self._counts = np.zeros((states, len(COMPASS_NAMES), states + 1)) + foretold
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
        by_symbol, leads = self._shares @ tried, csr_array(self._counts.reshape(tried.size, -1))
        for _ in range(200):
            own = tried + DISCOUNT * (leads @ self._cost).reshape(tried.shape)
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


def foretold(found: Inference, identifier: AutomatonState) -> Floats:
    """Some visits of each state and action, as the network predicts what they lead to, (states, actions, after)."""
    lost, count = identifier.lost, len(identifier.symbols)
    shares = found.chosen.partition.predicted(found.machine).reshape(lost, len(COMPASS_NAMES), -1)
    after = np.minimum(identifier.table(), lost)[:lost, count:].reshape(lost, len(COMPASS_NAMES), count)
    visits = np.zeros((lost + 1, len(COMPASS_NAMES), lost + 2))
    states, actions = np.ogrid[:lost, : len(COMPASS_NAMES)]
    for symbol in range(count):
        visits[states, actions, after[:, :, symbol]] += FORETOLD * shares[:, :, symbol]
    visits[:lost, :, -1] = FORETOLD * shares[:, :, -1]
    return visits


def states_of(kind: str, grid: GridMap, walks: Sequence[Walk], seed: int) -> tuple[Planner, float, float]:
    """A plan on states of a kind, and what they and the best of the last one to three pairs lose on held-out strings.

    The losses are 0 where they are not told.
    """
    if kind == "symbols":
        return Planner(IdentityState(grid.symbols)), 0.0, 0.0
    if not kind.endswith("pairs") and kind.startswith("last-"):
        return Planner(LastSymbols(grid.symbols, int(kind[-1]))), 0.0, 0.0
    strings = strings_of_walks(grid, [cut(walk) for walk in walks])
    if kind == "last-2 pairs":
        tree = PrefixTree.of(strings)
        return Planner(AutomatonState.of(last_letters(tree, 2, strings.actions), tree)), 0.0, 0.0
    found = inferred(strings, seed, 0 if kind == "untrained" else STEPS)
    identifier = AutomatonState.of(found.machine)
    planner = Planner(identifier, foretold(found, identifier))
    return planner, found.chosen.loss or 0.0, min(found.beside.values())


def cut(walk: Walk) -> Walk:
    """Its beginning: long random walks say little more, and cost as much as they are long."""
    if walk.steps <= LONGEST:
        return walk
    return Walk(walk.start, walk.symbols[: LONGEST + 1], walk.actions[:LONGEST], reached=False)


def learned(kind: str, grid: GridMap, seed: int) -> tuple[StateIdentifier, Floats, float, float]:
    """What 500 trials come to: states and policy, and what :func:`states_of` says of them."""
    everywhere = IdentityState(grid.symbols)
    by_chance = np.full((len(grid.symbols), len(COMPASS_NAMES)), 1.0 / len(COMPASS_NAMES))
    walks = [walked(grid, everywhere, by_chance, seed, trial, 0.0) for trial in range(TRIALS[0])]
    took: list[list[int]] = [[] for _ in SOFTNESS]
    for end in TRIALS[1:]:
        planner, loss, beside = states_of(kind, grid, walks, seed)
        identifier = planner.identifier
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


def on_map(job: tuple[str, int, str]) -> dict[str, Any] | str:
    """A run on a map; its name where the optimum takes too long."""
    name, seed, kind = job
    optimum = facts(name)["optimum"]
    return name if optimum is None else run(name, seed, kind, map_of(name), optimum)


def run(name: str, seed: int, kind: str, grid: GridMap, optimum: float) -> dict[str, Any]:
    began = process_time()
    identifier, policy, loss, beside = learned(kind, grid, seed)
    cpu_s = process_time() - began
    cost = expected_steps(grid, identifier, policy.tolist(), STEP_LIMIT)
    values = (name, seed, kind, round(optimum, 4), round(cost.steps, 4), round(cost.limited_steps / optimum, 4),
              round(cost.reaches_in_time, 6), len(identifier.states), round(loss, 4), round(beside, 4),
              round(cpu_s, 1))  # fmt: skip
    return dict(zip(COLUMNS, values, strict=True))


def nulls() -> None:
    for number in (0, 1):
        grid = map_of(str(number))
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
            f"every symbol says where it is, {kind}: {run('-', 0, kind, grid, float(belief_optimum(grid)))}",
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
    parser.add_argument("--maps", nargs="+", type=span, default=[["1"], ["2"], ["twin"]])
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
    done = {(row["map"], int(row["seed"]), row["kind"]) for row in rows}
    runs = product((name for names in options.maps for name in names), range(options.seeds), options.kinds)
    jobs, refused = [run for run in runs if run not in done], set()
    with Pool(options.jobs) as pool, options.out.open("a", newline="") as stream:
        writer = csv.DictWriter(stream, COLUMNS, lineterminator="\n")
        if not rows:
            writer.writeheader()
        for row in pool.imap(on_map, jobs):
            if isinstance(row, str):
                refused.add(row)
                continue
            writer.writerow(row)
            stream.flush()
            rows.append(row)
            print(", ".join(f"{name} {value}" for name, value in row.items()), flush=True)
    print(f"{len(refused)} maps refused: their optimum takes too long")
    tell(rows)


if __name__ == "__main__":
    main()
