"""Student's t interval, against a table of t and by simulation."""

from __future__ import annotations

import numpy as np
import pytest

from palpate.adapters.experiments.statistics import mean_with_interval, t_half_width


def test_three_values_by_hand() -> None:
    # t(0.975, 2 degrees of freedom) = 4.3027 in any table; the standard deviation is 1.
    mean, low, high = mean_with_interval([2.0, 3.0, 4.0])
    assert mean == 3.0
    assert (low, high) == pytest.approx((3.0 - 4.3027 / 3**0.5, 3.0 + 4.3027 / 3**0.5), abs=1e-4)


def test_times_are_not_negative() -> None:
    _, low, high = mean_with_interval([0.1, 3.0])
    assert low == 0.0
    assert high is not None
    assert high > 3.0


def test_one_value_has_no_interval() -> None:
    assert mean_with_interval([2.5]) == (2.5, None, None)
    with pytest.raises(ValueError, match="two values"):
        t_half_width(np.ones((1, 4)))


def test_it_covers_as_often_as_it_says() -> None:
    values = np.random.default_rng(1).normal(5.0, 2.0, size=(4, 5000))
    covered = np.abs(values.mean(axis=0) - 5.0) <= t_half_width(values)
    assert 0.94 < covered.mean() < 0.96
