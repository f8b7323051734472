"""The paper's learning curve over many seeds: 350 trials each, plain 17-state Q-learning, and its end beside a rule.

    python -m benchmarks.learning --seeds 10 --jobs 2

Prints one line per seed and the figures of docs/results.md, with bootstrap intervals over seeds; ``--out`` keeps every
exploration time as CSV and draws the pooled curve. The last 50 trials are run twice more: with the learned policy as
it is used, frozen, and with the hand-written torque rule; there what fails counts as the time limit. The seeds are
100, 101, ...: none of them was used while parameters were chosen (those were 0, 1 and 2).
"""

from __future__ import annotations

import argparse
import csv
import json
from dataclasses import replace
from multiprocessing import Pool
from pathlib import Path

import numpy as np

from palpate.adapters.config.run import scenario
from palpate.adapters.experiments.build import build_perception, build_task
from palpate.adapters.experiments.policies import comparator, learning_policy, loaded_policy
from palpate.adapters.experiments.statistics import moving_average
from palpate.adapters.experiments.trial import run_scored_trial
from palpate.adapters.mujoco.rig import SimulatedRig
from palpate.core.policy import document_of
from palpate.core.trial import find_ready_pose

FIRST_SEED = 100


LAST = 50


def learn(
    job: tuple[str, str, int, int],
) -> tuple[int, list[float], list[bool], list[str], float, dict[str, list[float]]]:
    """One training run: seed, times, successes, outcomes, highest true force, times of others in the last trials."""
    name, arm, seed, trials = job
    config = replace(scenario(name), arm=arm, seed=seed)
    ready, perception = find_ready_pose(config.arm, config.task), build_perception(config)
    task_policy = learning_policy(config, perception)
    task = build_task(config, ready, perception, task_policy)
    times, wins, outcomes, peak = [], [], [], 0.0
    with SimulatedRig(config, ready) as rig:
        for trial in range(trials):
            scored = run_scored_trial(config, rig, task, trial)
            times.append(scored.report.exploration_time_s)
            wins.append(scored.success)
            outcomes.append(str(scored.report.outcome and scored.report.outcome.value))
            peak = max(peak, scored.truth.peak_force_N)
        document = document_of(task_policy, created_with={}, perception={})
        others = {
            "in_use": loaded_policy(document, config, perception, frozen=True),
            "torque": comparator("torque", config, tuple),
        }
        beside = {}
        for label, policy in others.items():
            task = build_task(config, ready, perception, policy)
            scores = [run_scored_trial(config, rig, task, trial) for trial in range(max(trials - LAST, 0), trials)]
            limit_s = config.task.time_limit_s
            beside[label] = [one.report.exploration_time_s if one.success else limit_s for one in scores]
    return seed, times, wins, outcomes, peak, beside


def ratio_interval(a: np.ndarray, b: np.ndarray) -> tuple[float, float, float]:
    """Ratio of pooled means b/a over seeds with its 95 % bootstrap interval (seeds resampled)."""
    rng = np.random.default_rng(0)
    draws = rng.integers(len(a), size=(5000, len(a)))
    ratios = b[draws].mean(axis=1) / a[draws].mean(axis=1)
    low, high = np.quantile(ratios, [0.025, 0.975])
    return float(b.mean() / a.mean()), float(low), float(high)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenario", default="paper")
    parser.add_argument("--arm", default="zebra-zero")
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--first-seed", type=int, default=FIRST_SEED)
    parser.add_argument("--trials", type=int, default=350)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--out", type=Path)
    options = parser.parse_args()
    jobs = [
        (options.scenario, options.arm, seed, options.trials)
        for seed in range(options.first_seed, options.first_seed + options.seeds)
    ]
    times, wins = [], []
    beside: dict[str, list[float]] = {}
    failures: dict[str, int] = {}
    with Pool(options.jobs) as pool:
        for seed, t, w, outcomes, peak, others in pool.imap(learn, jobs):
            for label, found in others.items():
                beside.setdefault(label, []).extend(found)
            times.append(t)
            wins.append(w)
            for outcome in outcomes[125:]:
                failures[outcome] = failures.get(outcome, 0) + 1
            first, late = np.mean(t[:25]), np.mean(t[125:150]) if len(t) >= 150 else float("nan")
            share = np.mean(w[125:]) if len(w) > 125 else float("nan")
            print(
                f"seed {seed}: 1-25 {first:.2f} s, 126-150 {late:.2f} s, ratio {first / late:.1f}, "
                f"301-350 {np.mean(t[300:]) if len(t) > 300 else float('nan'):.2f} s, "
                f"success from 126 {share:.3f}, peak {peak:.1f} N; last {LAST}: "
                + ", ".join(f"{label} {np.mean(found):.2f} s" for label, found in others.items()),
                flush=True,
            )
    T, W = np.array(times), np.array(wins)
    if options.trials >= 350:
        ratios = T[:, :25].mean(axis=1) / T[:, 125:150].mean(axis=1)
        early, late = T[:, 125:175].mean(axis=1), T[:, 300:350].mean(axis=1)
        decay, low, high = ratio_interval(early, late)
        summary = {
            "scenario": options.scenario,
            "arm": options.arm,
            "seeds": [options.first_seed, options.first_seed + options.seeds - 1],
            "speed_up_median": round(float(np.median(ratios)), 2),
            "speed_up_min_max": [round(float(ratios.min()), 2), round(float(ratios.max()), 2)],
            "mean_s": {
                "1-25": round(float(T[:, :25].mean()), 3),
                "126-150": round(float(T[:, 125:150].mean()), 3),
                "126-175": round(float(early.mean()), 3),
                "301-350": round(float(late.mean()), 3),
            },
            "success_from_126": round(float(W[:, 125:].mean()), 4),
            "success_from_126_worst_seed": round(float(W[:, 125:].mean(axis=1).min()), 4),
            "outcomes_from_126": failures,
            "late_over_early": [round(decay, 3), round(low, 3), round(high, 3)],
            f"last_{LAST}_mean_p95_s": {
                label: [round(float(np.mean(found)), 3), round(float(np.quantile(found, 0.95)), 3)]
                for label, found in {"learning": np.where(W, T, 20.0)[:, -LAST:].ravel(), **beside}.items()
            },
        }
        print(json.dumps(summary, indent=1))
        if options.out:
            options.out.mkdir(parents=True, exist_ok=True)
            (options.out / "learning.json").write_text(json.dumps(summary, indent=1) + "\n")
    if options.out:
        options.out.mkdir(parents=True, exist_ok=True)
        with (options.out / "learning.csv").open("w", newline="") as stream:
            writer = csv.writer(stream, lineterminator="\n")
            writer.writerow(["trial", *(f"seed_{job[2]}" for job in jobs)])
            writer.writerows([k + 1, *column] for k, column in enumerate(T.T.round(4).tolist()))
        draw(T, options.out / "learning.png", f"Peg in hole, {options.arm}, scenario {options.scenario}")


def draw(times: np.ndarray, path: Path, title: str) -> None:
    """Moving average of 25 of every seed, and the median over seeds."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8.0, 4.2), dpi=120, layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    curves = np.array([moving_average(row.tolist()) for row in times])
    trials = np.arange(1, times.shape[1] + 1)
    for k, curve in enumerate(curves):
        label = f"{len(curves)} seeds, moving average of 25" if k == 0 else None
        axes.plot(trials, curve, color="#4878a8", linewidth=0.8, alpha=0.5, label=label)
    axes.plot(trials, np.median(curves, axis=0), color="black", linewidth=2.0, label="median")
    axes.set(xlabel="trial", ylabel="exploration time [s]", title=title)
    axes.set_ylim(bottom=0.0)
    axes.grid(alpha=0.25)
    axes.legend(loc="upper right")
    figure.savefig(path, metadata={"Software": None})


if __name__ == "__main__":
    main()
