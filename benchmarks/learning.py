"""The paper's learning curve for many seeds: Q-learning on 17 states, compared with a hand-written rule at the end.

    python -m benchmarks.learning --seeds 10 --first-seed 4400 --jobs 2 --out learning.jsonl --picture learning.png

The last 50 trials are also run with the frozen learned policy and with the torque rule; in these runs, a failure counts
as the time limit. The results for 350 trials are those in docs/results.md, with bootstrap intervals over the seeds.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.common import FAILED_S, Cell, Trials, parser_of, seeds_of, sweep, table
from palpate.adapters.config import scenario
from palpate.adapters.experiments import baseline, loaded_policy
from palpate.adapters.experiments.statistics import moving_average
from palpate.core.policy import document_of

LAST = 50
WHOLE = 350
STRETCHES = {"1-25": slice(0, 25), "126-150": slice(125, 150), "126-175": slice(125, 175), "301-350": slice(300, 350)}


def learn(cell: Cell) -> dict[str, Any]:
    """Run one training, then the last trials with the frozen policy and with the rule."""
    config = replace(scenario(cell["scenario"]), arm=cell["arm"], seed=cell["seed"])
    with Trials(config) as trials:
        scored = [trials.scored(number) for number in range(cell["trials"])]
        document = document_of(trials.policy, created_with={}, perception={})
    others = {
        "frozen": lambda config, perception, _: loaded_policy(document, config, perception, frozen=True),
        "torque rule": lambda config, *_: baseline("torque", config, tuple),
    }
    last = {}
    for name, make in others.items():
        with Trials(config, make) as trials:
            last[name] = [row.time_s for row in trials.run(range(max(cell["trials"] - LAST, 0), cell["trials"]))]
    return {
        "time_s": [each.report.exploration_time_s for _, each in scored],
        "success": [row.success for row, _ in scored],
        "outcome": [row.outcome for row, _ in scored],
        "peak_N": [row.peak_N for row, _ in scored],
        "last": last,
    }


def ratio(numerator_s: np.ndarray, denominator_s: np.ndarray) -> str:
    """Return a ratio of means over seeds, with its 95 % bootstrap interval over the seeds."""
    draws = np.random.default_rng(0).integers(len(numerator_s), size=(5000, len(numerator_s)))
    ratios = numerator_s[draws].mean(axis=1) / denominator_s[draws].mean(axis=1)
    low, high = np.quantile(ratios, [0.025, 0.975])
    return f"{numerator_s.mean() / denominator_s.mean():.2f} ({low:.2f} to {high:.2f})"


def draw(path: Path, times_s: np.ndarray, title: str) -> None:
    """Plot the moving averages of each seed and of all seeds."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7.0, 3.5), dpi=120, layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.add_subplot(title=title, xlabel="trial", ylabel="exploration [s]")
    for row in times_s:
        axes.plot(moving_average(row.tolist(), 25), color="0.8", linewidth=0.8)
    axes.plot(moving_average(times_s.mean(axis=0).tolist(), 25), color="#c0392b", linewidth=2.0)
    axes.set_ylim(bottom=0.0)
    figure.savefig(path, metadata={"Software": None})


def main() -> None:
    parser = parser_of(__doc__, seeds=10, first_seed=100, trials=WHOLE)
    parser.add_argument("--scenario", default="paper")
    parser.add_argument("--arm", default="zebra-zero")
    parser.add_argument("--picture", type=Path)
    options = parser.parse_args()
    shared = {"scenario": options.scenario, "arm": options.arm, "trials": options.trials}
    found = [one for _, one in sweep(options, learn, [{**shared, "seed": seed} for seed in seeds_of(options)])]
    times_s, success = (np.array([one[name] for one in found]) for name in ("time_s", "success"))
    peak_N = max(max(one["peak_N"]) for one in found)
    rows: list[tuple[str, object]] = [("highest true force, N", float(peak_N))]
    for name in ("learning", *found[0]["last"]):
        if name == "learning":
            last_s = np.where(success, times_s, FAILED_S)[:, -LAST:].ravel()
        else:
            last_s = np.array([one["last"][name] for one in found]).ravel()
        rows.append((f"last {LAST}, {name}: mean, p95, s", f"{last_s.mean():.3f}, {np.quantile(last_s, 0.95):.2f}"))
    if options.trials >= WHOLE:
        mean_s = {name: times_s[:, trials].mean(axis=1) for name, trials in STRETCHES.items()}
        speed_up = mean_s["1-25"] / mean_s["126-150"]
        outcomes = Counter(outcome for one in found for outcome in one["outcome"][125:])
        rows += [
            ("speed-up, median", float(np.median(speed_up))),
            ("speed-up, range", f"{speed_up.min():.1f} to {speed_up.max():.1f}"),
            *((f"trials {name}, mean s", float(mean.mean())) for name, mean in mean_s.items()),
            ("trials 301-350 over 126-175", ratio(mean_s["301-350"], mean_s["126-175"])),
            ("success from trial 126", f"{success[:, 125:].sum()} of {success[:, 125:].size}; {dict(outcomes)}"),
        ]
    print(table(("figure", "measured"), rows))
    if options.picture:
        draw(options.picture, times_s, f"{options.scenario}, {options.arm}, {options.seeds} seeds")


if __name__ == "__main__":
    main()
