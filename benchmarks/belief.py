"""The belief learner under each condition: success, time, trials to convergence, and forces.

    python -m benchmarks.belief --seeds 10 --trials 50 --jobs 2 --out belief.jsonl
    python -m benchmarks.belief --conditions blind --trials 1 --seeds 100     first trials, with nothing known
    python -m benchmarks.belief --policy torque                               a baseline, at 50 ms and 7 Hz

Times are exploration times in seconds; a failure counts as 20. "Converged" is the first trial at which the mean of the
next ten is within 20 % of the mean from trial 11 on. The last column is the wall-clock time of a decision, which is
meaningful only on an idle machine with one job.
"""

from __future__ import annotations

import gc
from dataclasses import replace
from time import perf_counter
from typing import Any
from unittest.mock import patch

import numpy as np

from benchmarks.common import QUICK_STEPS, Cell, Row, Trials, converged, parser_of, seeds_of, share, sweep, table
from palpate.adapters.config import overlay, scenario
from palpate.adapters.experiments import baseline
from palpate.core.policy import Decision, Observation
from palpate.core.policy.belief import learner

CONDITIONS = (
    "paper", "blind", "blind-tilt-2", "blind-tilt-4", "blind-bias", "blind-bias-drawn", "blind-noise", "blind-regrip",
    "blind-corner", "blind-smooth", "blind-rough", "blind-tight", "blind-5", "blind-grip", "ur5",
)  # fmt: skip
FIRST_SEED = 1900
HEAD = (
    "condition", "policy", "seeds", "first trial", "from trial 2", "mean 2-10, s", "mean 11-, s (seeds)", "median",
    "p95", "converged", "force p99 / most, N", "decision 99 / 99.9 %, ms",
)  # fmt: skip


def _timed(into_s: list[float]) -> Any:
    """Record the duration of each decision."""
    choose = learner.BeliefLearner.choose

    def timed_choose(policy: learner.BeliefLearner, observation: Observation) -> Decision:
        begun_s = perf_counter()
        decision = choose(policy, observation)
        into_s.append(perf_counter() - begun_s)
        return decision

    return patch.object(learner.BeliefLearner, "choose", timed_choose)


def run(cell: Cell) -> dict[str, Any]:
    """Run one seed of a condition."""
    condition, policy = cell["condition"], cell["policy"]
    name, arm = ("blind", "ur5") if condition == "ur5" else (condition, "zebra-zero")
    config = replace(scenario(name, "belief"), arm=arm, seed=cell["seed"])
    make = None
    if policy != "belief":
        config = overlay(config, QUICK_STEPS)
        make = lambda config, _, hole: baseline(policy, config, hole)  # noqa: E731
    decisions_s: list[float] = []
    rows = []
    with Trials(config, make) as trials, _timed(decisions_s):
        # A pause of the garbage collector is no part of a decision; a rig can have it between trials, too.
        gc.disable()
        for number in range(cell["trials"]):
            gc.collect()
            rows.append(trials.scored(number)[0])
        gc.enable()
    return {"trials": rows, "decisions_us": [round(1e6 * each) for each in decisions_s]}


def line(condition: str, policy: str, seeds: list[dict[str, Any]]) -> tuple[object, ...]:
    """Return a row of the table."""
    trials = [[Row(*row) for row in seed["trials"]] for seed in seeds]
    times_s, wins, peaks_N = (np.array([[row[place] for row in rows] for rows in trials]) for place in (0, 1, 3))
    decisions_ms = [1e-3 * each for seed in seeds for each in seed["decisions_us"]]
    figures: list[object] = [condition, policy, len(seeds), share(int(wins[:, 0].sum()), len(seeds))]
    if times_s.shape[1] > 10:
        late_s, later = times_s[:, 10:], wins[:, 1:]
        by_seed_s = late_s.mean(axis=1)
        figures += [
            share(int(later.sum()), later.size), float(times_s[:, 1:10].mean()),
            f"{late_s.mean():.3f} ({by_seed_s.min():.2f} to {by_seed_s.max():.2f})", f"{np.median(late_s):.3f}",
            float(np.quantile(late_s, 0.95)), f"{np.median([converged(row) for row in times_s]):g}",
        ]  # fmt: skip
    else:
        figures += ["", f"{times_s.mean():.2f} (all)", "", "", float(np.quantile(times_s, 0.95)), ""]
    figures.append(f"{np.quantile(peaks_N, 0.99):.1f} / {peaks_N.max():.1f}")
    slow = np.quantile(decisions_ms, [0.99, 0.999]) if decisions_ms else None
    return (*figures, "" if slow is None else f"{slow[0]:.2f} / {slow[1]:.2f}")


def main() -> None:
    parser = parser_of(__doc__, seeds=10, first_seed=FIRST_SEED, trials=50)
    parser.add_argument("--conditions", nargs="+", default=CONDITIONS, choices=CONDITIONS)
    parser.add_argument("--policy", default="belief", help="belief, torque or another baseline")
    options = parser.parse_args()
    # Seeds first: an early end leaves some of each condition.
    cells = [
        {"condition": condition, "policy": options.policy, "seed": seed, "trials": options.trials}
        for seed in seeds_of(options)
        for condition in options.conditions
    ]
    found = sweep(options, run, cells)
    rows = [
        line(condition, options.policy, [one for cell, one in found if cell["condition"] == condition])
        for condition in options.conditions
    ]
    print(table(HEAD, rows))


if __name__ == "__main__":
    main()
