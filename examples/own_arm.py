"""An arm of your own: the adapter in ``line_arm`` is moved, and held to the contracts of its two ports.

The other end of the line is a few lines of Python, so nothing has to be connected. You see what the arm was asked to do
and what it really did - a command beyond its limits comes back cut, and says why - and then how many clauses of each
contract it keeps. Takes a few seconds.

The command line tries the contracts with ``palpate check-adapter``; docs/how-to/your-own-arm.md goes on from here.
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent / "line_arm"))

from checks import HOME_RAD, ArmChecks, EncoderChecks, bench

from palpate.core.ports import JointCommand
from palpate.core.ports.contracts import ClauseOutcome, run_clauses


def move() -> None:
    """Ask for a small step and for one that is beyond the limits."""
    clock, _, arm = bench()
    arm.configure()
    arm.activate()
    for step_rad in (0.005, 1.0):
        asked = (HOME_RAD[0] + step_rad, *HOME_RAD[1:])
        clock.advance()
        applied = arm.send(JointCommand(asked))
        clock.advance()
        there = arm.read().position_rad
        print(
            f"asked for {asked[0]:.4f} rad, applied {applied.position_rad[0]:.4f} ({applied.reason.value}),"
            f" at {there[0]:.4f}"
        )
    arm.stop()
    arm.close()


def main() -> None:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("runs/own-arm"), help="folder for the list of clauses")
    options = parser.parse_args()
    path = options.out / "clauses.txt"
    if path.exists():
        parser.error(f"{path} is there already; name another folder with --out")
    try:
        options.out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        parser.error(f"{options.out} cannot be made ({error.strerror}); name another folder with --out")
    move()
    lines = []
    for suite in (ArmChecks(), EncoderChecks()):
        results = run_clauses(suite)
        counts = Counter(result.outcome for result in results)
        print(
            f"{type(suite).__name__}: " + ", ".join(f"{counts[outcome]} {outcome.value}" for outcome in ClauseOutcome)
        )
        lines += [f"{result.outcome.value}: {result.clause.statement} {result.message}".rstrip() for result in results]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    print(f"look at {path}")
    sys.exit(any(line.startswith(ClauseOutcome.FAILED.value) for line in lines))


if __name__ == "__main__":
    main()
