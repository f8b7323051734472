"""Summaries of trials: what a table or a ``summary.json`` says about them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from math import sqrt
from typing import Any

import numpy as np

from palpate.adapters.experiments.results import TrialRow

WINDOW = 25
"""Trials in the moving average, as in the paper's figure 5."""


def moving_average(values: Sequence[float], window: int = WINDOW) -> list[float]:
    """Mean of the last ``window`` values at each place; shorter at the beginning."""
    sums = np.concatenate(([0.0], np.cumsum(np.asarray(values, dtype=float))))
    return [float((sums[i + 1] - sums[max(0, i + 1 - window)]) / min(i + 1, window)) for i in range(len(values))]


def wilson_interval(successes: int, trials: int, z: float = 1.96) -> tuple[float, float]:
    """Wilson score interval of a share, 95 % by default."""
    if trials == 0:
        return 0.0, 1.0
    share = successes / trials
    centre = (share + z * z / (2 * trials)) / (1 + z * z / trials)
    half = z / (1 + z * z / trials) * sqrt(share * (1 - share) / trials + z * z / (4 * trials * trials))
    return max(0.0, centre - half), min(1.0, centre + half)


def bootstrap_interval(
    values: Sequence[float], quantile: float, draws: int = 2000, level: float = 0.95
) -> tuple[float, float]:
    """Percentile bootstrap interval of a quantile; fixed seed, because it describes the data and nothing else."""
    data = np.asarray(values, dtype=float)
    if len(data) == 0:
        # Not NaN: JSON has none, and a run that ended before its first trial has a summary too.
        return 0.0, 0.0
    rng = np.random.default_rng(0)
    estimates = np.quantile(rng.choice(data, size=(draws, len(data))), quantile, axis=1)
    low, high = np.quantile(estimates, [(1 - level) / 2, (1 + level) / 2])
    return float(low), float(high)


def summary_of(rows: Sequence[TrialRow]) -> dict[str, Any]:
    """Figures over all trials of a run; times count failures with the time they took."""
    times = [row.exploration_time_s for row in rows]
    successes = sum(row.success for row in rows)
    return {
        "trials": len(rows),
        "success": _share(successes, len(rows)),
        "success_95": [round(v, 4) for v in wilson_interval(successes, len(rows))],
        "median_s": _rounded(times, 0.5),
        "median_95_s": [round(v, 4) for v in bootstrap_interval(times, 0.5)],
        "p95_s": _rounded(times, 0.95),
        "p95_95_s": [round(v, 4) for v in bootstrap_interval(times, 0.95)],
        "peak_force_N": round(max((row.peak_force_N for row in rows), default=0.0), 3),
        "outcomes": {name: sum(row.outcome == name for row in rows) for name in sorted({r.outcome for r in rows})},
        "marked": sum(bool(row.marked) for row in rows),
        "marked_why": _reasons(rows),
    }


def learning_summary(rows: Sequence[TrialRow]) -> dict[str, Any]:
    """How exploration time fell in the course of a training run, in windows of trials (counted from 1)."""
    windows: dict[str, Any] = {}
    for first, last in ((1, 25), (126, 150), (126, 175), (301, 350)):
        part = rows[first - 1 : last]
        if len(part) == last - first + 1:
            windows[f"mean_s_{first}_{last}"] = round(sum(r.exploration_time_s for r in part) / len(part), 4)
    if "mean_s_126_150" in windows:
        late_s = windows["mean_s_126_150"]
        windows["speed_up"] = round(windows["mean_s_1_25"] / late_s, 3) if late_s > 0.0 else None
        late = rows[125:]
        windows["success_from_126"] = _share(sum(r.success for r in late), len(late))
    return windows


def _reasons(rows: Sequence[TrialRow]) -> dict[str, int]:
    """How many trials each objection to their timing fell on; a trial may have several."""
    reasons = (reason.partition(" (")[0] for row in rows for reason in row.marked.split("; ") if reason)
    return dict(sorted(Counter(reasons).items()))


def _share(part: int, whole: int) -> float:
    return round(part / whole, 4) if whole else 0.0


def _rounded(values: Sequence[float], quantile: float) -> float:
    return round(float(np.quantile(values, quantile)), 4) if values else 0.0
