"""Inference of Tomita's seven languages from random strings: Elman networks and partitioning, RPNI and EDSM (AALpy).

    python -m benchmarks.automata_tomita --seeds 20 --jobs 2 --out tomita.jsonl

A sample consists of n strings of length 0 to 15, half of them accepted. The length is uniform over the lengths that
occur in the language (or its complement), and the string is uniform over those of that length, so short strings repeat.
All methods get only these strings. Success is equality with the language itself, for strings of any length. Networks
use at most 256 restarts, and the training strings alone determine the choice among them. The samples use seeds from
100, which were not used to choose settings (0 to 3 were). The third language occurs in both common forms; the other
form is number 8. With --long N, the results also classify N strings of length 50 to 1000, half of them accepted.
"""

from __future__ import annotations

import re
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from itertools import groupby, pairwise, product
from statistics import mean
from time import process_time
from typing import Any

import numpy as np

from benchmarks.common import Cell, parser_of, seeds_of, sweep, table
from palpate.core.automata.infer import InferenceSettings, infer
from palpate.core.automata.machine import Kind, Machine
from palpate.core.automata.minimise import difference, minimised
from palpate.core.automata.strings import Strings
from palpate.core.automata.training import TrainingSettings

FIRST_SEED = 100
LONGEST, LONG = 15, (50, 1000)
BINARY = ("0", "1")


def _odd_zeros_after_odd_ones(word: str) -> bool:
    runs = [(symbol, len(list(same))) for symbol, same in groupby(word)]
    return any(a == "1" and m % 2 and n % 2 for (a, m), (_, n) in pairwise(runs))


def _odd_zeros_ever_after_odd_ones(word: str) -> bool:
    odd = [symbol for symbol, same in groupby(word) if len(list(same)) % 2]
    return "1" in odd and "0" in odd[odd.index("1") :]


@dataclass(frozen=True)
class Language:
    transitions: tuple[tuple[int, int], ...]
    accepted: tuple[int, ...]
    contains: Callable[[str], bool]

    @property
    def machine(self) -> Machine:
        outputs = tuple(state in self.accepted for state in range(len(self.transitions)))
        return minimised(Machine(Kind.DFA, BINARY, self.transitions, outputs))


LANGUAGES = {
    1: Language(((1, 0), (1, 1)), (0,), lambda w: "0" not in w),
    2: Language(((2, 1), (0, 2), (2, 2)), (0,), lambda w: re.fullmatch("(10)*", w) is not None),
    3: Language(((0, 1), (2, 0), (3, 4), (2, 1), (4, 4)), (0, 1, 3), lambda w: not _odd_zeros_after_odd_ones(w)),
    4: Language(((1, 0), (2, 0), (3, 0), (3, 3)), (0, 1, 2), lambda w: "000" not in w),
    5: Language(((1, 2), (0, 3), (3, 0), (2, 1)), (0,), lambda w: w.count("0") % 2 == 0 and w.count("1") % 2 == 0),
    6: Language(((1, 2), (2, 0), (0, 1)), (0,), lambda w: (w.count("0") - w.count("1")) % 3 == 0),
    7: Language(((0, 1), (2, 1), (2, 3), (4, 3), (4, 4)), (0, 1, 2, 3), lambda w: w.count("10") <= 1),
    # The third in its other common form: an odd run of 0 may come no time after an odd run of 1, not just at once.
    8: Language(((0, 1), (2, 0), (3, 4), (2, 3), (4, 4)), (0, 1, 3), lambda w: not _odd_zeros_ever_after_odd_ones(w)),
}
STATES = {1: 2, 2: 3, 3: 5, 4: 4, 5: 4, 6: 3, 7: 5, 8: 5}


def _networks(order: int, hidden: int) -> InferenceSettings:
    training = TrainingSettings(restarts=256, batch=64, steps=400, enough=16)
    return InferenceSettings(order=order, hidden=hidden, held_out=0.0, training=training, finalists=32)


NETWORKS = {"second-order, 3 units": _networks(2, 3), "first-order, 2 units": _networks(1, 2)}
MERGERS = ("RPNI", "EDSM")


def check_languages() -> None:
    """Check the tables against the definitions in words, for all strings up to length 10."""
    for number, language in LANGUAGES.items():
        assert len(language.machine.transitions) == STATES[number]
        for length in range(11):
            for word in product((0, 1), repeat=length):
                said = language.machine.output_of(word)
                assert said is language.contains("".join(map(str, word))), (number, word)


def draw(language: Language, count: int, seed: int, shortest: int = 0, longest: int = LONGEST) -> Strings:
    """Draw a balanced sample of random strings."""
    machine, rng = language.machine, np.random.default_rng(seed)
    targets = np.array(machine.transitions)
    words, labels = [], []
    for label in (True, False):
        # ways[k][s]: strings of length k that lead from state s to one with this label.
        outputs = [np.array([output is label for output in machine.state_outputs], dtype=float)]
        for _ in range(longest):
            outputs.append(outputs[-1][targets].sum(axis=1))
        lengths = [length for length, way in enumerate(outputs) if way[machine.start] and length >= shortest]
        for _ in range(count // 2):
            state, word = machine.start, []
            for left in reversed(range(int(rng.choice(lengths)))):
                zero, one = outputs[left][targets[state]]
                word.append(int(rng.random() * (zero + one) >= zero))
                state = targets[state, word[-1]]
            words.append(tuple(word))
            labels.append(label)
    return Strings(BINARY, tuple(words), tuple(labels))


def merged(method: str, strings: Strings) -> Machine:
    """Return the automaton inferred by RPNI or EDSM. Strings that it leaves undecided are rejected."""
    from aalpy.learning_algs import run_EDSM, run_RPNI

    data = [[word, label] for word, label in dict(zip(strings.words, strings.labels, strict=True)).items()]
    learn = run_RPNI if method == "RPNI" else run_EDSM
    with warnings.catch_warnings():
        # That some transitions and outputs are unknown is dealt with below.
        warnings.simplefilter("ignore", UserWarning)
        model = learn(data, "dfa", print_info=False)
    number = {state: place for place, state in enumerate(model.states)}
    sink = len(model.states)
    rows = [
        tuple(number[state.transitions[symbol]] if symbol in state.transitions else sink for symbol in (0, 1))
        for state in model.states
    ]
    outputs = (*(bool(state.is_accepting) for state in model.states), False)
    return Machine(Kind.DFA, BINARY, (*rows, (sink, sink)), outputs, start=number[model.initial_state])


def run(cell: Cell) -> dict[str, Any]:
    """Run one method on one sample of one language."""
    language, method = LANGUAGES[cell["language"]], cell["method"]
    strings = draw(language, cell["strings"], cell["seed"])
    began = process_time()
    found: dict[str, Any] = {}
    if method in MERGERS:
        machine = minimised(merged(method, strings))
    else:
        inferred = infer(strings, NETWORKS[method])
        machine = inferred.machine
        found = {"restarts": len(inferred.training.networks), "consistent": inferred.training.consistent}
    seconds = process_time() - began
    right = 0
    if cell["long"]:
        long = draw(language, cell["long"], cell["seed"], *LONG)
        right = sum(machine.output_of(word) is label for word, label in zip(long.words, long.labels, strict=True))
    exact = difference(machine, language.machine) is None
    return {**found, "exact": exact, "states": len(machine.transitions), "seconds": seconds, "long_right": right}


def lines(found: list[tuple[Cell, dict[str, Any]]]) -> list[tuple[object, ...]]:
    """Return a row per string count and method: exact results by language, and CPU seconds for one sample of each."""
    rows = []
    for count, method in dict.fromkeys((cell["strings"], cell["method"]) for cell, _ in found):
        ours = [(cell["language"], one) for cell, one in found if (cell["strings"], cell["method"]) == (count, method)]
        exact = [sum(one["exact"] for number, one in ours if number == language) for language in LANGUAGES]
        seconds = sum(mean(one["seconds"] for number, one in ours if number == language) for language in LANGUAGES)
        rows.append((count, method, *exact, seconds, sum(one["long_right"] for _, one in ours)))
    return rows


def main() -> None:
    parser = parser_of(__doc__, seeds=20, first_seed=FIRST_SEED, trials=0)
    parser.add_argument("--strings", type=int, nargs="+", default=[200, 100, 50])
    parser.add_argument("--methods", nargs="+", default=[*NETWORKS, *MERGERS], choices=[*NETWORKS, *MERGERS])
    parser.add_argument("--long", type=int, default=0, help="long strings that each automaton classifies")
    options = parser.parse_args()
    check_languages()
    cells = [
        {"strings": count, "method": method, "language": language, "seed": seed, "long": options.long}
        for count, method, language, seed in product(options.strings, options.methods, LANGUAGES, seeds_of(options))
    ]
    head = ("strings", "method", *(f"T{number}" for number in LANGUAGES), "CPU s a draw", "long strings right")
    print(table(head, lines(sweep(options, run, cells))))


if __name__ == "__main__":
    main()
