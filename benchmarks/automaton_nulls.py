"""Automata with actions where nothing is to be gained: shuffled walks, untrained networks, symbols that say all.

    python -m benchmarks.automaton_nulls --maps 0 1

On each of the maps, which are those of benchmarks/memory_maps.py, 200 random walks: the held-out loss of the automaton
that is inferred from them by gradients, nats a symbol, beside those of the last none to three pairs; the same of
untrained networks, and of walks whose pairs are shuffled over all strings. The learners' own models, automata and
clones, fitted by Baum-Welch to the first half of the walks, are judged on the second half, as walked and shuffled. On
a map where every symbol says where it is, last, the cost of each learner's frozen policy, over the optimum.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from functools import partial

import numpy as np

from benchmarks.memory_maps import LEARNERS, frozen, in_use, map_of
from palpate.adapters.experiments.grid import Named, learn
from palpate.core.automata import InferenceSettings, Strings, TrainingSettings, infer
from palpate.core.automata.choice import ExtractionSettings, last_letters, model_loss
from palpate.core.automata.elman import NORMALISED
from palpate.core.automata.prefix_tree import PrefixTree
from palpate.core.policy.memory import RecordedTrial
from palpate.core.policy.memory.automaton_model import fit_automata
from palpate.core.policy.memory.clone_fit import fit_clones
from palpate.simulation.grid import UNDISTURBED, GridMap, belief_optimum, walk_strings

WALKS, LONGEST, UNITS = 200, 60, 80


def shuffled(strings: Strings) -> Strings:
    """The same first symbols and lengths, with the pairs of all in another order."""
    pairs = iter(np.random.default_rng(0).permutation([pair for word in strings.words for pair in word[1:]]).tolist())
    words = tuple((word[0], *(next(pairs) for _ in word[1:])) for word in strings.words)
    return Strings(strings.alphabet, words, actions=strings.actions, ends=strings.ends)


def by_gradients(strings: Strings, steps: int) -> str:
    training = TrainingSettings(steps=steps, learning_rate=0.6, clip=100.0, flat_looks=1)
    extraction = ExtractionSettings(fewest_intervals=3, most_intervals=4, most_states=1000)
    hidden = len(strings.names) * round(UNITS / len(strings.names))
    settings = InferenceSettings(activation=NORMALISED, hidden=hidden, training=training, extraction=extraction)
    found = infer(strings, settings)
    beside = ", ".join(f"{who} {loss:.4f}" for who, loss in found.beside.items())
    return f"automaton {found.chosen.loss:.4f} nats a symbol; {beside}"


def trials_of(strings: Strings) -> list[RecordedTrial]:
    count, found = len(strings.names), []
    for word, end in zip(strings.words, strings.ends, strict=True):
        actions = [pair // count - 1 for pair in word[1:]]
        found.append(
            RecordedTrial(
                tuple(pair % count for pair in word), (*actions, *([] if end is None else [end])), end is not None
            )
        )
    return found


def by_learners(strings: Strings) -> str:
    trials, half = trials_of(strings), len(strings.words) // 2
    told = [
        f"{kind} {fit(trials[:half], len(strings.names), len(strings.actions))[0].log_loss(trials[half:]):.4f}"
        for kind, fit in (("automata", fit_automata), ("clones", partial(fit_clones, merging=True)))
    ]
    first, second = (PrefixTree.of(part) for part in parts(strings, half))
    losses = [
        model_loss(last_letters(first, length, strings.actions), first, second) for length in range(4)
    ]  # without the first symbol of a string, which the model's own loss has
    beside = ", ".join(f"last {length} {loss:.4f}" for length, loss in enumerate(losses))
    return f"learners' models {', '.join(told)}; {beside}"


def parts(strings: Strings, half: int) -> Sequence[Strings]:
    return [
        Strings(strings.alphabet, strings.words[part], actions=strings.actions, ends=strings.ends[part])
        for part in (slice(half), slice(half, None))
    ]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--maps", nargs="+", default=["0", "1"])
    options = parser.parse_args()
    for name in options.maps:
        strings = walk_strings(map_of(name), WALKS, 0, LONGEST, with_actions=True)
        mixed = shuffled(strings)
        print(f"map {name}, as walked: {by_learners(strings)}", flush=True)
        print(f"map {name}, shuffled: {by_learners(mixed)}", flush=True)
        print(f"map {name}, as walked: {by_gradients(strings, 120)}", flush=True)
        print(f"map {name}, untrained: {by_gradients(strings, 0)}", flush=True)
        print(f"map {name}, shuffled: {by_gradients(mixed, 120)}", flush=True)
    grid = GridMap.from_regions("ABC/D.E/FGH")
    optimum = float(belief_optimum(grid))
    for learner in ("offset-500", "clones-500", "automaton-500", "pairs", "symbols"):
        states, settings, trials = LEARNERS[learner]
        run = learn(grid, Named(states), settings, 0, trials)
        found, _ = frozen(grid, run, in_use(run), UNDISTURBED, 20)
        print(
            f"every symbol says where it is, {learner}: {found.limited_steps / optimum:.3f} of the optimum", flush=True
        )


if __name__ == "__main__":
    main()
