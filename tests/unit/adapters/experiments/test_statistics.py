"""Figures about trials, against values known from elsewhere."""

import json
from dataclasses import replace
from math import comb

import numpy as np
import pytest

from palpate.adapters.cli.notices import flagged_line
from palpate.adapters.experiments import Claim, exact_interval, mean_with_interval, summary_of, t_half_width
from palpate.adapters.experiments.statistics import learning_summary, quantile_interval
from palpate.core.errors import ConfigurationError
from tests.unit.adapters.samples import trial_rows


@pytest.mark.parametrize(
    ("successes", "trials", "low", "high"),
    [
        # From tables of Clopper and Pearson's interval (R: binom.test, to four digits).
        (0, 10, 0.0, 0.3085),
        (1, 10, 0.0025, 0.4450),
        (8, 10, 0.4439, 0.9748),
        (10, 10, 0.6915, 1.0),
        (50, 100, 0.3983, 0.6017),
        (0, 0, 0.0, 1.0),
    ],
)
def test_exact_interval(successes, trials, low, high):
    assert exact_interval(successes, trials) == pytest.approx((low, high), abs=1e-4)


@pytest.mark.parametrize("quantile", [0.5, 0.95])
def test_interval_of_a_quantile_ends_at_the_order_statistics_of_exact_binomial_chances(quantile):
    count = 101
    values = list(np.random.default_rng(1).exponential(2.0, count))
    interval = quantile_interval(values, quantile)
    ranks = np.searchsorted(np.sort(values), interval) + 1
    # The quantile lies between the values of ranks r and s when at least r and fewer than s values are below it.
    chance = [comb(count, k) * quantile**k * (1 - quantile) ** (count - k) for k in range(count + 1)]
    assert sum(chance[ranks[0] : ranks[1]]) >= 0.95
    assert sum(chance[ranks[0] + 1 : ranks[1]]) < 0.975
    assert sum(chance[ranks[0] : ranks[1] - 1]) < 0.975


@pytest.mark.parametrize(("quantile", "fewest"), [(0.5, 6), (0.95, 72)])
def test_no_interval_is_stated_where_there_are_too_few_values(quantile, fewest):
    values = [float(n) for n in range(fewest)]
    interval = quantile_interval(values, quantile)
    assert interval[1] == values[-1]
    assert quantile_interval(values[1:], quantile) is None
    assert quantile_interval([], quantile) is None


def test_summary_counts_failures_with_their_time():
    rows = [*trial_rows(1.0, 3.0), *trial_rows(20.0, success=False)]
    rows[1] = replace(rows[1], peak_force_N=9.5)
    summary = summary_of(rows)
    assert summary["trials"] == 3
    assert summary["success"] == 0.6667
    assert summary["median_s"] == 3.0
    assert summary["p95_s"] == pytest.approx(18.3)
    assert summary["peak_force_N"] == 9.5
    assert summary["outcomes"] == {"inserted": 2, "time limit": 1}
    assert summary["success_95"] == [0.0943, 0.9916]
    assert summary["median_95_s"] == summary["p95_95_s"] == [None, None]
    assert json.dumps(summary_of([]), allow_nan=False)


def test_learning_shows_in_windows_of_trials_counted_from_one():
    times = [8.0] * 25 + [5.0] * 100 + [2.0] * 25 + [3.0] * 25
    summary = learning_summary(trial_rows(*times))
    assert summary == {
        "mean_s_1_25": 8.0,
        "mean_s_126_150": 2.0,
        "mean_s_126_175": 2.5,
        "speed_up": 4.0,
        "success_from_126": 1.0,
    }


def test_flagged_trials_are_counted_by_reason():
    rows = trial_rows(1.0, 1.0, 1.0, 1.0)
    rows[1] = replace(rows[1], flagged="slots skipped (30)")
    rows[3] = replace(rows[3], flagged="a tick too late (21.0 ms); slots skipped (7)")
    summary = summary_of(rows)
    assert (summary["flagged"], summary["flagged_reasons"]) == (2, {"a tick too late": 1, "slots skipped": 2})
    line = "flagged for their timing: 2 of 4 trials, not learned from (a tick too late 1, slots skipped 2)\n"
    assert flagged_line(summary, learned=False) == line
    assert flagged_line(summary_of(rows[:1]), learned=False) == ""


def test_three_values_by_hand():
    # t(0.975, 2 degrees of freedom) = 4.3027 in any table; the standard deviation is 1.
    mean, low, high = mean_with_interval([2.0, 3.0, 4.0])
    assert mean == 3.0
    assert (low, high) == pytest.approx((3.0 - 4.3027 / 3**0.5, 3.0 + 4.3027 / 3**0.5), abs=1e-4)


def test_one_value_has_no_interval():
    assert mean_with_interval([2.5]) == (2.5, None, None)
    with pytest.raises(ValueError, match="two values"):
        t_half_width(np.ones((1, 4)))


def test_as_many_trials_as_are_needed_prove_a_claim_and_one_fewer_does_not():
    claim = Claim.parse("success >= 0.99")
    assert claim.verdict(368, 368) == "proved"
    assert claim.verdict(367, 367) == "inconclusive"
    assert claim.verdict(367, 368) == "inconclusive"
    assert claim.verdict(350, 368) == "refuted"
    assert claim.verdict(0, 0) == "inconclusive"


@pytest.mark.parametrize("text", ["", "success", "success > 0.9", "success >= 1", "success >= 99", "time >= 0.5"])
def test_other_words_are_refused(text):
    with pytest.raises(ConfigurationError, match=r"success >= SHARE"):
        Claim.parse(text)
