"""Train, and look at what was learned.

Q-learning puts the peg into the hole over and over. You see a line for every trial, at first mostly of several seconds,
later mostly of one or two. In the end the table of what was learned is printed: for each state the best action. The
folder then holds the policy, the learning curve, a log of every trial and a picture of the last one: forces, tip,
states and actions over time.

Takes about half a minute; with ``--quick``, which is too short to learn anything, a few seconds.

The command line does the same with ``palpate train``, ``palpate show`` and ``palpate log plot``.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from palpate.adapters.experiments import Run, ScoredTrial, load_policy, render_table
from palpate.adapters.log import read_log, timeline
from palpate.core.errors import PalpateError, require_whole


def tell(scored: ScoredTrial) -> None:
    """A line for a trial. Whether it was a success is held against the simulator's truth."""
    report, word = scored.report, "inserted" if scored.success else "failed"
    print(f"trial {report.setup.index:3d}: {scored.exploration_time_s:5.1f} s of exploration, {word}", flush=True)


def main() -> None:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--trials", type=int, default=100)
    parser.add_argument("--quick", action="store_true", help="three short trials")
    parser.add_argument("--out", type=Path, default=Path("runs/train-and-look"), help="must not hold a run yet")
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
