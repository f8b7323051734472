"""Figures about trials, against values known from elsewhere."""

from __future__ import annotations

import json
from dataclasses import replace
from math import comb, inf

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.adapters.cli.notices import marked_line
from palpate.adapters.experiments.statistics import (
    bootstrap_interval,
    learning_summary,
    moving_average,
    summary_of,
    wilson_interval,
)
from tests.unit.adapters.samples import trial_rows


@given(st.lists(st.floats(0.0, 100.0), max_size=60), st.integers(1, 30))
def test_moving_average_is_the_mean_of_the_last_values(values: list[float], window: int) -> None:
    plain = [np.mean(values[max(0, i + 1 - window) : i + 1]) for i in range(len(values))]
    assert moving_average(values, window) == pytest.approx(plain, abs=1e-9)


@pytest.mark.parametrize(
    ("successes", "trials", "low", "high"),
    [
        # From Wilson's formula worked out by others (R: binom::binom.wilson, to four digits).
        (0, 10, 0.0, 0.2775),
        (8, 10, 0.4902, 0.9433),
        (10, 10, 0.7225, 1.0),
        (50, 100, 0.4038, 0.5962),
        (0, 0, 0.0, 1.0),
    ],
)
def test_wilson_interval(successes: int, trials: int, low: float, high: float) -> None:
    assert wilson_interval(successes, trials) == pytest.approx((low, high), abs=1e-4)


def test_bootstrap_of_the_median_agrees_with_order_statistics() -> None:
    values = np.random.default_rng(1).exponential(2.0, 101)
    low, high = bootstrap_interval(list(values), 0.5)
    # Distribution-free: the median lies between two order statistics with at least 95 %.
    chance = [comb(101, k) / 2**101 for k in range(102)]
    rank = max(k for k in range(50) if sum(chance[k : 101 - k + 1]) >= 0.95)
    ordered = np.sort(values)
    assert low == pytest.approx(ordered[rank - 1], abs=0.15)
    assert high == pytest.approx(ordered[101 - rank], abs=0.15)
    assert low < np.median(values) < high


def test_bootstrap_depends_on_the_data_alone() -> None:
    values = [0.3, 1.2, 0.8, 4.0, 2.2]
    assert bootstrap_interval(values, 0.95) == bootstrap_interval(values, 0.95)
    assert bootstrap_interval([2.0] * 9, 0.95) == (2.0, 2.0)


def test_bootstrap_interval_narrows_with_more_data() -> None:
    values = np.random.default_rng(2).exponential(2.0, 400)
    widths = [high - low for low, high in (bootstrap_interval(list(values[:n]), 0.5) for n in (25, 400))]
    assert widths[1] < 0.5 * widths[0]


def test_summary_counts_failures_with_their_time() -> None:
    rows = [*trial_rows(1.0, 3.0), *trial_rows(20.0, success=False)]
    rows[1] = replace(rows[1], peak_force_N=9.5)
    summary = summary_of(rows)
    assert summary["trials"] == 3
    assert summary["success"] == 0.6667
    assert summary["median_s"] == 3.0
    assert summary["p95_s"] == pytest.approx(18.3)
    assert summary["peak_force_N"] == 9.5
    assert summary["outcomes"] == {"inserted": 2, "time limit": 1}
    for interval in ("success_95", "median_95_s", "p95_95_s"):
        low, high = summary[interval]
        assert -inf < low <= high < inf


def test_summary_of_no_trials_is_plain_json() -> None:
    # A run that is ended in its first trial has a summary, too.
    assert json.dumps(summary_of([]), allow_nan=False)


def test_learning_shows_in_windows_of_trials_counted_from_one() -> None:
    times = [8.0] * 25 + [5.0] * 100 + [2.0] * 25 + [3.0] * 25
    summary = learning_summary(trial_rows(*times))
    assert summary == {
        "mean_s_1_25": 8.0,
        "mean_s_126_150": 2.0,
        "mean_s_126_175": 2.5,
        "speed_up": 4.0,
        "success_from_126": 1.0,
    }


def test_windows_that_are_not_full_are_left_out() -> None:
    assert learning_summary(trial_rows(*[8.0] * 24)) == {}
    assert learning_summary(trial_rows(*[8.0] * 149)) == {"mean_s_1_25": 8.0}


def test_trials_that_are_marked_are_counted_by_reason_and_told() -> None:
    rows = trial_rows(1.0, 1.0, 1.0, 1.0)
    rows[1] = replace(rows[1], marked="slots skipped (30)")
    rows[3] = replace(rows[3], marked="a tick too late (21.0 ms); slots skipped (7)")
    summary = summary_of(rows)
    assert (summary["marked"], summary["marked_why"]) == (2, {"a tick too late": 1, "slots skipped": 2})
    line = "marked for their timing: 2 of 4 trials, not learned from (a tick too late 1, slots skipped 2)\n"
    assert marked_line(summary, learned=False) == line
    assert marked_line(summary_of(rows[:1]), learned=False) == ""
