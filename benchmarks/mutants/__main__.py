"""A hundred small changes of functions that a change of the house leaves alone, run against their tests.

    python -m benchmarks.mutants draw --before ../before --after . --out mutants.json
    python -m benchmarks.mutants run --checkout ../before --mutants mutants.json --out before.jsonl
    python -m benchmarks.mutants run --mutants mutants.json --out after.jsonl --jobs 2
    python -m benchmarks.mutants compare before.jsonl after.jsonl
    python -m benchmarks.mutants gate --out gate.jsonl        # the core alone, against the golden logs: see gate.py

Drawn are functions that both checkouts have word for word (layout, comments, docstrings and the places that they import
from apart), by a fixed seed, and in each of them one change. Each checkout's own tests judge: those of the function's
room, then the golden logs, then the contracts, up to the first failure and for 60 s at most in all, in which what other
work on the machine takes does not count.

A failure counts when the test fails again with the change and passes without it. Where the time was up, the mutant was
killed by that if the tests that were then running need at most half of the time they had without it; otherwise it was
not killed in time. Verdicts are appended as they are reached: a run that was ended goes on where it was, and what
a busy machine has left undecided can be judged anew (--again); of a mutant's verdicts the last one counts.
"""

from __future__ import annotations

import argparse
import json
import sys
from dataclasses import asdict
from pathlib import Path

from benchmarks.mutants import gate
from benchmarks.mutants.draw import Mutant, draw
from benchmarks.mutants.verdicts import compared, lost, read, run

HERE = Path(__file__).parents[2]


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(dest="command", required=True)
    drawing = commands.add_parser("draw", help="write a list of mutants")
    drawing.add_argument("--before", type=Path, required=True)
    drawing.add_argument("--after", type=Path, default=HERE)
    drawing.add_argument("--count", type=int, default=100)
    drawing.add_argument("--seed", type=int, default=16)
    drawing.add_argument("--out", type=Path, required=True)
    running = commands.add_parser("run", help="judge mutants in one checkout")
    running.add_argument("--checkout", type=Path, default=HERE)
    running.add_argument("--mutants", type=Path, required=True)
    running.add_argument("--out", type=Path, required=True)
    running.add_argument("--jobs", type=int, default=1)
    running.add_argument("--limit-s", type=float, default=60.0)
    running.add_argument("--only", nargs="+", metavar="ID", help="these mutants, and no others")
    running.add_argument("--again", action="store_true", help="judge anew what was not killed in time")
    running.add_argument("--first", type=int, help="so many of them, from the list's beginning")
    comparing = commands.add_parser("compare", help="list what was killed before and is not after")
    comparing.add_argument("before", type=Path)
    comparing.add_argument("after", type=Path)
    gating = commands.add_parser(
        "gate",
        help="replay the golden logs over mutants of the core",
        description=gate.__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    gating.add_argument("--checkout", type=Path, default=HERE)
    gating.add_argument("--one-in", type=int, default=gate.ONE_IN, help="one place in so many")
    gating.add_argument("--seed", type=int, default=gate.SEED)
    gating.add_argument("--only", default="", help="files whose names hold this")
    gating.add_argument("--jobs", type=int, default=1)
    gating.add_argument("--out", type=Path, required=True)
    options = parser.parse_args()
    if options.command == "gate":
        return gate.run(options.checkout, options.out, options.one_in, options.seed, options.only, options.jobs)
    if options.command == "draw":
        mutants = draw(options.before, options.after, options.count, options.seed)
        options.out.write_text(json.dumps([asdict(mutant) for mutant in mutants], indent=1) + "\n", encoding="utf-8")
        return 0
    if options.command == "run":
        mutants = [Mutant(**fields) for fields in json.loads(options.mutants.read_text(encoding="utf-8"))]
        if options.only:
            mutants = [mutant for mutant in mutants if mutant.id in options.only]
        run(
            options.checkout,
            mutants[: options.first],
            options.out,
            jobs=options.jobs,
            limit_s=options.limit_s,
            again=options.again,
        )
        return 0
    before, after = read(options.before), read(options.after)
    print(compared(before, after))
    return 1 if lost(before, after) else 0


if __name__ == "__main__":
    sys.exit(main())
