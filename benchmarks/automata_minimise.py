"""Minimisation and comparison of random machines against AALpy and automata-lib.

    python -m benchmarks.automata_minimise --machines 10000

Acceptors, Moore and Mealy machines of one to 30 states, most with states that no word leads to, many incomplete; pairs
of random ones, of one state, with every state twice, and such that differ on the empty word only. Prints every
disagreement and the total times, and ends with status 1 if there is one. AALpy minimises complete machines only, so all
get the same completion; automata-lib knows acceptors only. Last, single large acceptors without AALpy, whose
minimisation takes cubic time.
"""

from __future__ import annotations

import argparse
import random
import sys
from collections import Counter
from time import perf_counter

from benchmarks.automata_others import SORTS, CrossCheck, pair, to_automata_lib
from palpate.core.automata.machine import Kind
from palpate.core.automata.minimise import minimised
from tests.unit.core.automata.machines import doubled, random_machine

LARGE = (100, 1000, 10_000)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--machines", type=int, default=10_000)
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    rng, check = random.Random(arguments.seed), CrossCheck()
    kinds: Counter[str] = Counter()
    for number in range(arguments.machines // 2):
        one, other = pair(rng, SORTS[number % len(SORTS)])
        for machine in (one, other):
            kinds[f"{machine.kind.value}, {'complete' if machine.complete else 'incomplete'}"] += 1
            kinds["with unreachable states"] += len(machine.reachable()) < len(machine.transitions)
            check.machine(machine)
        check.pair(one, other)
    for name, count in sorted(kinds.items()):
        print(f"{count:6d} {name}")
    for task, seconds in sorted(check.seconds.items()):
        print(f"{seconds:8.2f} s {task}")
    print(f"{len(check.disagreements)} disagreements")
    for line in check.disagreements:
        print(line)
    for states in LARGE:
        machine = doubled(random_machine(rng, Kind.DFA, states // 2, symbols=6), rng)
        library = to_automata_lib(machine)
        times_s = [perf_counter()]
        for minimise in (lambda machine=machine: minimised(machine), library.minify):
            minimise()
            times_s.append(perf_counter())
        mine_s, theirs_s = times_s[1] - times_s[0], times_s[2] - times_s[1]
        print(f"{states:6d} states, 6 symbols: palpate {mine_s:.3f} s, automata-lib {theirs_s:.3f} s")
    sys.exit(bool(check.disagreements))


if __name__ == "__main__":
    main()
