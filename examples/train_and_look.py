"""Train a policy, and inspect the result.

Q-learning inserts the peg repeatedly. The script prints a line for every trial; most of the first trials take several
seconds, and most of the later ones take one or two. At the end it prints the best action for each state. The output
folder contains the policy, the learning curve, a log of every trial, and a plot of forces, tip position, states and
actions in the last trial.

It takes about half a minute, or a few seconds with ``--quick``, which is too short to learn anything.

The commands ``palpate train``, ``palpate show`` and ``palpate log plot`` do the same.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from palpate.adapters.experiments import Run, ScoredTrial, load_policy, render_table
from palpate.adapters.log import read_log, timeline
from palpate.core.errors import PalpateError, require_whole


def tell(scored: ScoredTrial) -> None:
    """Print one line for a trial. Success is determined by the simulator's ground truth."""
    report, word = scored.report, "inserted" if scored.success else "failed"
    print(f"trial {report.setup.index:3d}: {scored.exploration_time_s:5.1f} s of exploration, {word}", flush=True)


def main() -> None:
    """Parse the command line, and run the script."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--trials", type=int, default=100)
    parser.add_argument("--quick", action="store_true", help="run only three short trials")
    parser.add_argument("--out", type=Path, default=Path("runs/train-and-look"), help="must not contain a run")
    options = parser.parse_args()
    settings, trials = ({"task": {"time_limit_s": 2.0}}, 3) if options.quick else ({}, options.trials)
    try:
        require_whole("trials", trials, 1, 1_000_000)
        result = Run(settings=settings).train(trials, options.out, on_trial=tell)
        (options.out / "last-trial.png").write_bytes(timeline(read_log(result.logs[-1])))
    except (PalpateError, OSError) as error:
        parser.error(str(error))
    print(render_table(load_policy(result.policy)))
    print(f"look at {options.out}/learning_curve.png and {options.out}/last-trial.png")


if __name__ == "__main__":
    main()
