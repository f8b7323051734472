"""Trial statistics for tables and ``summary.json``, with 95 % intervals.

Importing scipy.stats takes a second, so it is imported only where an interval is computed.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from math import inf, isfinite
from typing import Any, Final, TypeAlias

import numpy as np
import numpy.typing as npt

from palpate.adapters.config import RunConfig
from palpate.adapters.experiments.results import TrialRow
from palpate.adapters.log import tally
from palpate.core.errors import ConfigurationError

Array: TypeAlias = npt.NDArray[np.float64]

LEVEL: Final = 0.95

WINDOW: Final = 25
"""Number of trials in the moving average, as in the paper's figure 5."""


def window_of(trials: int) -> int:
    """Return the window size for a plotted average; 1 below twice the paper's 25 trials, to show the first trials."""
    return WINDOW if trials >= 2 * WINDOW else 1


def moving_average(values: Sequence[float], window: int = WINDOW) -> list[float]:
    """Return the mean of the last ``window`` values at each index, or of fewer values at the beginning."""
    sums = np.concatenate(([0.0], np.cumsum(np.asarray(values, dtype=float))))
    return [float((sums[i + 1] - sums[max(0, i + 1 - window)]) / min(i + 1, window)) for i in range(len(values))]


def exact_interval(successes: int, trials: int) -> tuple[float, float]:
    """Return the two-sided Clopper-Pearson interval for a proportion; it is 0 to 1 if there are no trials."""
    from scipy.stats import binomtest

    if trials == 0:
        return 0.0, 1.0
    found = binomtest(successes, trials).proportion_ci(LEVEL, method="exact")
    return float(found.low), float(found.high)


@dataclass(frozen=True)
class Claim:
    """A claimed lower bound on the success rate."""

    share: float

    @classmethod
    def parse(cls, text: str) -> Claim:
        """Read a claim.

        Raises:
            ConfigurationError: The text is not ``success >= SHARE`` with a share between 0 and 1.
        """
        found = re.fullmatch(r"\s*success\s*>=\s*(0?\.\d+)\s*", text)
        share = float(found.group(1)) if found else 0.0
        if not 0.0 < share < 1.0:
            raise ConfigurationError("claim", text, "success >= SHARE with a share between 0 and 1: success >= 0.99")
        return cls(share)

    def verdict(self, successes: int, trials: int) -> str:
        """Compare the exact 95 % interval for the success rate with the claim."""
        low, high = exact_interval(successes, trials)
        if low >= self.share:
            return "proved"
        return "refuted" if high < self.share else "inconclusive"

    def __str__(self) -> str:
        return f"success >= {self.share:g}"


def quantile_interval(values: Sequence[float], quantile: float) -> tuple[float, float] | None:
    """Return a confidence interval for a quantile, between two of the values, from exact binomial probabilities.

    Unlike the bootstrap, it covers the true quantile with at least 95 % probability, for any distribution.
    It is None if there are too few values: fewer than 6 for the median, fewer than 72 for the 95th percentile.
    """
    from scipy.stats import quantile_test

    if not values:
        return None
    found = quantile_test(np.asarray(values, dtype=float), p=quantile).confidence_interval(LEVEL)
    low, high = float(found.low), float(found.high)
    return (low, high) if isfinite(low) and isfinite(high) else None


def t_half_width(values: Array) -> Array:
    """Return half the width of Student's t interval for the mean over the first axis of (n, ...), with n at least 2.

    The bootstrap is not used because there are few seeds: three resampled values stay within the range of the three, so
    its intervals are far too narrow.
    """
    from scipy.stats import t

    count = len(values)
    if count < 2:
        raise ValueError("an interval needs at least two values")
    factor = float(t.ppf((1.0 + LEVEL) / 2.0, count - 1)) / count**0.5
    half: Array = factor * np.std(values, axis=0, ddof=1)
    return half


def mean_with_interval(values: Sequence[float], highest: float = inf) -> tuple[float, float | None, float | None]:
    """Return the mean of values from 0 to ``highest``, and the ends of the t interval, or None for a single value."""
    data = np.asarray(values, dtype=float)
    mean = float(data.mean())
    if len(data) < 2:
        return mean, None, None
    half = float(t_half_width(data))
    return mean, max(0.0, mean - half), min(mean + half, max(highest, mean))


def shown_interval(value: float, low: float | None, high: float | None) -> str:
    """Return a value with its interval, if there is one, in brackets."""
    return f"{value:.2f}" if low is None or high is None else f"{value:.2f} [{low:.2f}, {high:.2f}]"


def summary_of(rows: Sequence[TrialRow]) -> dict[str, Any]:
    """Return statistics for a run's trials, including failures; interval ends that cannot be computed are None."""
    times = [row.exploration_time_s for row in rows]
    successes = sum(row.success for row in rows)
    return {
        "trials": len(rows),
        "success": _share(successes, len(rows)),
        "success_95": _ends(exact_interval(successes, len(rows))),
        "median_s": _rounded(times, 0.5),
        "median_95_s": _ends(quantile_interval(times, 0.5)),
        "p95_s": _rounded(times, 0.95),
        "p95_95_s": _ends(quantile_interval(times, 0.95)),
        "peak_force_N": round(max((row.peak_force_N for row in rows), default=0.0), 3),
        "outcomes": tally(row.outcome for row in rows),
        "trips": tally(row.trip.partition(":")[0] for row in rows if row.trip),
        "flagged": sum(bool(row.flagged) for row in rows),
        # A trial may be flagged for several reasons.
        "flagged_reasons": tally(why.partition(" (")[0] for row in rows for why in row.flagged.split("; ") if why),
    }


def learning_summary(rows: Sequence[TrialRow]) -> dict[str, Any]:
    """Return the decrease in exploration time during training, per window of trials (numbered from 1)."""
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


def run_summary(config: RunConfig, rows: Sequence[TrialRow], trials: int, **facts: Any) -> dict[str, Any]:
    """Return the statistics for a run with this number of requested trials, preceded by data about the run."""
    named = {"scenario": config.scenario, "arm": str(config.arm), "seed": config.seed, "finished": len(rows) >= trials}
    return {**facts, **named, **summary_of(rows)}


def _ends(interval: tuple[float, float] | None) -> list[float | None]:
    return [None, None] if interval is None else [round(end, 4) for end in interval]


def _share(part: int, whole: int) -> float:
    return round(part / whole, 4) if whole else 0.0


def _rounded(values: Sequence[float], quantile: float) -> float:
    return round(float(np.quantile(values, quantile)), 4) if values else 0.0
