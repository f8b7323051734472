"""The belief learner under each condition: success, times from trial 11 on, trials to converge, forces.

    python -m benchmarks.belief --seeds 10 --trials 50 --jobs 2 --out belief.jsonl

One line a seed goes to ``--out`` as soon as it is there, and a second call goes on where the first was ended. Times are
seconds of exploration; a failure counts 20. "Converged" is the first trial from which the mean of the next ten is
within 20 % of the mean of trials 11 to 50.

``--first-trials 100`` runs so many first trials instead, a seed each, with nothing known. The last column is how long a
decision took in the longer of its two ticks, of the wall clock: a figure for an idle machine and one job.

``--policy belief-WITHOUT`` leaves out one part of the learner: what each part is worth.
"""

from __future__ import annotations

import argparse
import gc
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import replace
from operator import itemgetter
from pathlib import Path
from time import perf_counter
from typing import Any
from unittest.mock import patch

import numpy as np

from benchmarks.seeds import gone_on_with
from palpate.adapters.config import overlay, scenario
from palpate.adapters.experiments import build_perception, build_task, comparator, learning_policy, run_scored_trial
from palpate.adapters.experiments.statistics import wilson_interval
from palpate.adapters.mujoco import SimulatedRig
from palpate.core.policy import Decision, Observation
from palpate.core.policy.belief import fit, learner, planner
from palpate.core.policy.belief.places import Places
from palpate.core.trial import find_ready_pose

CONDITIONS = (
    "paper", "blind", "blind-tilt-2", "blind-tilt-4", "blind-bias", "blind-bias-drawn", "blind-noise", "blind-regrip",
    "blind-corner", "blind-smooth", "blind-rough", "blind-tight", "blind-5", "blind-grip", "ur5",
)  # fmt: skip
FIRST_SEED = 1900
_NOTHING = 1e12
"""A prior count against which no touch counts."""
FAILED_S = 20.0


def _anywhere(holes: Sequence[object], places: Places) -> np.ndarray:
    return np.full((places.size, places.size), 1.0 / places.size**2)


ABLATIONS: dict[str, Sequence[Any]] = {
    "belief": (),
    "belief-symmetry": (patch.object(fit, "_CUE_COUNT", _NOTHING),),
    "belief-residual": (patch.object(fit, "_RESIDUAL_SHARE", 1e-9),),
    "belief-prior": (patch.object(learner, "place_prior", _anywhere),),
    "belief-lengths": (patch.object(planner, "_LENGTHS_M", ()), patch.object(planner, "_HEADINGS", 8)),
}
"""What each leaves out; ``lengths`` all ways but eight headings of one length."""


def _timed(into: list[float]) -> Any:
    """Adds what each decision took: of its two ticks, that in which it is prepared and its own, the longer one."""
    choose, foresee = learner.BeliefLearner.choose, learner.BeliefLearner.foresee
    prepared_s = [0.0]

    def timed_foresee(policy: learner.BeliefLearner, place_m: tuple[float, float]) -> None:
        begun_s = perf_counter()
        foresee(policy, place_m)
        prepared_s[:] = [perf_counter() - begun_s]

    def timed_choose(policy: learner.BeliefLearner, observation: Observation) -> Decision:
        begun_s = perf_counter()
        decision = choose(policy, observation)
        into.append(max(perf_counter() - begun_s, *prepared_s))
        prepared_s[:] = [0.0]
        return decision

    return patch.multiple(learner.BeliefLearner, choose=timed_choose, foresee=timed_foresee)


def run(job: tuple[str, str, int, int]) -> dict[str, Any]:
    """One seed of a condition: times, successes, outcomes, true peak forces."""
    condition, policy, seed, trials = job
    name, arm = ("blind", "ur5") if condition == "ur5" else (condition, "zebra-zero")
    config = replace(scenario(name, "belief"), arm=arm, seed=seed)
    if policy not in ABLATIONS:
        quick = {"task": {"ticks_per_action": 7, "moving_share": 0.8}, "perception": {"cutoff_Hz": 7.0}}
        config = overlay(config, quick)
    ready, perception = find_ready_pose(config.arm, config.task), build_perception(config)
    rows = []
    decisions_s: list[float] = []
    with SimulatedRig(config, ready) as rig, ExitStack() as without:
        without.enter_context(_timed(decisions_s))
        for each in ABLATIONS.get(policy, ()):
            without.enter_context(each)

        def hole_m() -> Sequence[float]:
            return rig.truth().hole_in_task_m

        chosen = learning_policy(config, perception) if policy in ABLATIONS else comparator(policy, config, hole_m)
        task = build_task(config, ready, perception, chosen)
        # A pause of the garbage collector is no part of a decision; a rig can have it between trials, too.
        without.callback(gc.enable)
        gc.disable()
        for trial in range(trials):
            gc.collect()
            scored = run_scored_trial(config, rig, task, trial)
            time_s = round(scored.report.exploration_time_s, 4) if scored.success else FAILED_S
            outcome = scored.report.outcome
            rows.append((time_s, scored.success, outcome and outcome.value, round(rig.truth().peak_force_N, 2)))
    decisions_us = [round(1e6 * value) for value in decisions_s]
    return {"condition": condition, "policy": policy, "seed": seed, "trials": rows, "decisions_us": decisions_us}


def converged(times: np.ndarray, settled: int = 10) -> int:
    """First trial, from 1, from which the mean of the next ten is within 20 % of that of trials 11 to the last.

    Args:
        settled: So many first trials are none of those of which that mean is.
    """
    late = times[settled:].mean()
    for first in range(len(times) - 10):
        if abs(times[first : first + 10].mean() - late) <= 0.2 * late:
            return first + 1
    return len(times)


def line(condition: str, policy: str, seeds: Sequence[dict[str, Any]]) -> str:
    """A row of the table."""
    times = np.array([[trial[0] for trial in seed["trials"]] for seed in seeds])
    wins = np.array([[trial[1] for trial in seed["trials"]] for seed in seeds])
    peaks = np.array([[trial[3] for trial in seed["trials"]] for seed in seeds])
    later, late = wins[:, 1:], times[:, 10:]
    low, high = wilson_interval(int(later.sum()), later.size)
    spread = late.mean(axis=1)
    cells = (
        condition, policy, str(len(seeds)),
        f"{int(wins[:, 0].sum())} of {len(seeds)}",
        f"{later.size - int(later.sum())} of {later.size} failed ({100 * low:.1f} to {100 * high:.1f} %)",
        f"{times[:, 1:10].mean():.2f}",
        f"{late.mean():.3f} ({spread.min():.2f} to {spread.max():.2f})",
        f"{np.median(late):.3f}", f"{np.quantile(late, 0.95):.2f}",
        f"{np.median([converged(row) for row in times]):g}",
        f"{np.quantile(peaks, 0.99):.1f} / {peaks.max():.1f}", decisions(seeds),
    )  # fmt: skip
    return "| " + " | ".join(cells) + " |"


def decisions(seeds: Sequence[dict[str, Any]]) -> str:
    """How long a decision took, ms, at 99 and 99.9 %; nothing of files of before."""
    taken_ms = [1e-3 * each for seed in seeds for each in seed.get("decisions_us", ())]
    return f"{np.quantile(taken_ms, 0.99):.2f} / {np.quantile(taken_ms, 0.999):.2f}" if taken_ms else ""


def first_line(condition: str, policy: str, seeds: Sequence[dict[str, Any]]) -> str:
    """A row of the table of first trials."""
    times, wins = ([seed["trials"][0][k] for seed in seeds] for k in (0, 1))
    low, high = wilson_interval(sum(wins), len(wins))
    found = f"{sum(wins)} of {len(wins)} ({100 * low:.1f} to {100 * high:.1f} %)"
    return f"| {condition} | {policy} | {found} | {np.mean(times):.2f} | {np.quantile(times, 0.95):.2f} |"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--conditions", nargs="+", default=CONDITIONS, choices=CONDITIONS)
    parser.add_argument(
        "--policy", default="belief", help=f"{', '.join(ABLATIONS)}, torque or another comparator, at 50 ms and 7 Hz"
    )
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--first-seed", type=int, default=FIRST_SEED)
    parser.add_argument("--trials", type=int, default=50)
    parser.add_argument("--first-trials", type=int, default=0, help="so many first trials, a seed each, and no more")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--out", type=Path, required=True)
    options = parser.parse_args()
    if options.first_trials:
        options.seeds, options.trials = options.first_trials, 1
    # Seeds first: an early end leaves some of each condition.
    jobs = {
        (condition, options.policy, seed): (condition, options.policy, seed, options.trials)
        for seed in range(options.first_seed, options.first_seed + options.seeds)
        for condition in options.conditions
    }
    done = gone_on_with(options.out, options.jobs, run, jobs, itemgetter("condition", "policy", "seed"))
    head = (
        "| condition | policy | seeds | first trial | from trial 2 | mean 2-10, s | mean 11-, s (seeds) | median"
        " | p95 | converged | force p99 / most, N | decision 99 / 99.9 %, ms |"
    )
    if options.first_trials:
        head = "| condition | policy | first trial | mean, s | p95 |"
    print(head + "\n" + "|---" * (head.count("|") - 1) + "|")
    for condition in options.conditions:
        rows = [seed for seed in done if (seed["condition"], seed["policy"]) == (condition, options.policy)]
        if rows:
            print((first_line if options.first_trials else line)(condition, options.policy, rows))


if __name__ == "__main__":
    main()
