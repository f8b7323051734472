"""Distributions in fixed memory: quantiles within a bin, everything else exact."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from palpate.adapters.hardware.real_time.lateness import Histograms, bins_of

TIMES = st.lists(st.integers(0, 2**52), min_size=1, max_size=300)


@given(times=TIMES)
def test_a_quantile_is_off_by_at_most_a_thirty_second(times: list[int]) -> None:
    histograms = Histograms(1)
    for part in np.array_split(np.array(times, np.int64).reshape(-1, 1), 3):
        histograms.add(part, np.ones_like(part, bool))
    spread = histograms.spread(0)
    assert (spread.count, spread.max_ns) == (len(times), max(times))
    assert spread.mean_ns == sum(times) / len(times)
    for share, found in ((0.5, spread.median_ns), (0.99, spread.p99_ns), (0.999, spread.p999_ns)):
        exact = sorted(times)[int(np.ceil(share * len(times))) - 1]
        assert abs(found - exact) <= exact / 32


@given(times=TIMES)
def test_bins_keep_the_order(times: list[int]) -> None:
    bins = bins_of(np.sort(np.array(times, np.int64)))
    assert (np.diff(bins) >= 0).all()


def test_columns_are_apart_and_what_is_not_there_does_not_count() -> None:
    histograms = Histograms(2)
    histograms.add(np.array([[5, 7], [9, 100]]), np.array([[True, True], [True, False]]))
    assert (histograms.spread(0).count, histograms.spread(0).max_ns) == (2, 9)
    assert (histograms.spread(1).count, histograms.spread(1).max_ns) == (1, 7)


def test_an_empty_column_is_all_zero() -> None:
    assert Histograms(1).spread(0).count == 0
