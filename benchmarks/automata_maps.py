"""Automata from walks in grid maps: what training and extraction take, and what the automata are worth.

    python -m benchmarks.automata_maps --maps 1 2 twin --seeds 3 --jobs 2 --learn 5

64 two-unit Elman networks that predict, on 1000 walks of at most 30 symbols. As a measure the automaton's cross-entropy
on held-out walks stands beside that of its network, of the last one, two and three symbols, and of the automaton that
is chosen from the same networks before training, for untrained networks are no bad memory either (Tino and others,
2004). With ``--learn``, Q-learning follows on the states of each: mean steps of the last 100 of 1500 trials. The seeds
are 200, 201, ...; those that settings were chosen with are 0, 1 and 100.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from dataclasses import replace
from multiprocessing import Pool
from statistics import mean
from time import process_time

import numpy as np

from palpate.adapters.config.grid import GridLearning
from palpate.adapters.experiments.grid.learning import learn
from palpate.adapters.experiments.grid.worlds import Followed, grid_named
from palpate.core.automata.choice import ExtractionSettings, last_letters, model_loss
from palpate.core.automata.infer import Inference, InferenceSettings, infer
from palpate.core.automata.machine import Machine
from palpate.core.automata.prefix_tree import PrefixTree
from palpate.core.automata.strings import Strings
from palpate.core.automata.training import TrainingSettings
from palpate.simulation.grid.trial import walk_strings

FIRST_SEED = 200


def extraction_ms(found: Inference) -> list[float]:
    """Milliseconds for all q of a network, with minimisation; for each network."""
    settings, took = ExtractionSettings(), []
    for trained in found.training.networks:
        began = process_time()
        for cells in settings.partitions(trained.network):
            cells.minimal(settings.least_share)
        took.append(1e3 * (process_time() - began))
    return took


def lines(job: tuple[str, int, argparse.Namespace]) -> list[str]:
    name, seed, options = job
    grid = grid_named(name, 7)
    strings = walk_strings(grid, options.walks, seed, options.longest)
    training = TrainingSettings(restarts=options.restarts, steps=options.steps, seed=seed)
    settings = InferenceSettings(training=training, finalists=options.finalists)
    began = process_time()
    found = infer(strings, settings)
    inferred_s = process_time() - began
    raw = infer(strings, replace(settings, training=replace(training, steps=0)))
    took = extraction_ms(found)
    kept, held = (PrefixTree.of(part) for part in strings.split(settings.held_out, seed))
    network = found.network.network.read(found.network.network.hidden_states(held))
    network_loss = float(-(held.counts * np.log(network)).sum() / held.counts.sum())
    trained = found.network
    told = [
        f"map {name}, seed {seed}: {options.restarts} networks, {strings.symbols} symbols, {inferred_s:.1f} CPU s; "
        f"all q with minimisation {mean(took):.0f} ms a network, longest {max(took):.0f} ms",
        f"    network {trained.restart} of loss {trained.loss:.4f} in training, {network_loss:.4f} held out",
    ]
    contenders = {f"last {count}": last_letters(kept, count) for count in (1, 2, 3)}
    contenders |= {"untrained": raw.machine, "automaton": found.machine}
    for who, machine in contenders.items():
        chosen = {"untrained": raw.chosen, "automaton": found.chosen}.get(who)
        about = "" if chosen is None else f", q = {chosen.intervals}, {chosen.raw_states} cells"
        loss = model_loss(machine, kept, held)
        told.append(f"    {who:10s} {len(machine.transitions):4d} states, loss {loss:.4f}{about}")
        if options.learn:
            last = list(steps(name, machine, strings, options.learn))
            told[-1] += f"; {mean(last):.2f} steps ({min(last):.2f} to {max(last):.2f})"
    return told


def steps(name: str, machine: Machine, strings: Strings, runs: int) -> Iterator[float]:
    """Mean steps at the end of each learning run."""
    for seed in range(FIRST_SEED, FIRST_SEED + runs):
        run = learn(grid_named(name, 7), Followed(machine, strings), GridLearning(), seed)
        yield mean(run.steps[-100:])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--maps", nargs="+", default=["1", "2", "twin"])
    parser.add_argument("--seeds", type=int, default=1)
    parser.add_argument("--first-seed", type=int, default=FIRST_SEED)
    parser.add_argument("--walks", type=int, default=1000)
    parser.add_argument("--longest", type=int, default=30)
    parser.add_argument("--restarts", type=int, default=64)
    parser.add_argument("--steps", type=int, default=TrainingSettings().steps)
    parser.add_argument("--finalists", type=int, default=InferenceSettings().finalists)
    parser.add_argument("--learn", type=int, default=0, help="learning runs on the states of each")
    parser.add_argument("--jobs", type=int, default=2)
    options = parser.parse_args()
    seeds = range(options.first_seed, options.first_seed + options.seeds)
    with Pool(options.jobs) as pool:
        for told in pool.imap(lines, [(name, seed, options) for name in options.maps for seed in seeds]):
            print("\n".join(told), flush=True)


if __name__ == "__main__":
    main()
