"""Claims: how many trials they take, and what trials show of them."""

import pytest

from palpate.adapters.experiments import Claim, ClaimVerdict, TrialRow


def row(success: bool, force_N: float = 10.0) -> TrialRow:
    return TrialRow(
        trial=0, outcome="", success=success, exploration_time_s=0.3, actions=1, peak_force_N=force_N,
        measured_peak_force_N=force_N, depth_mm=10.0, start_x_mm=0.0, start_y_mm=0.0, hole_x_mm=0.0, hole_y_mm=0.0,
        ticks=1, temperature=None, marked="",
    )  # fmt: skip


@pytest.mark.parametrize(("percent", "confidence", "fewest"), [(99.9, 95.0, 3688), (99.0, 95.0, 368), (95.0, 90.0, 59)])
def test_as_many_trials_as_are_needed_prove_it_and_one_fewer_does_not(
    percent: float, confidence: float, fewest: int
) -> None:
    claim = Claim(success_percent=percent, confidence_percent=confidence)
    assert claim.fewest == fewest
    assert claim.judge([row(True)] * fewest)[0] is ClaimVerdict.PROVED
    assert claim.judge([row(True)] * (fewest - 1))[0] is ClaimVerdict.OPEN
    assert claim.judge([row(True)] * (fewest - 1) + [row(False)])[0] is ClaimVerdict.OPEN


def test_the_interval_is_that_of_clopper_and_pearson() -> None:
    # Clopper and Pearson 1934, and any table of it: 1 of 10 at 95 % is 0.25 % to 44.5 %.
    _, interval = Claim().judge([row(True)] + [row(False)] * 9)
    assert interval == pytest.approx((0.00253, 0.44502), abs=1e-5)


def test_a_great_force_is_no_good_end() -> None:
    verdict, (_, high) = Claim(force_N=30.0).judge([row(True, 30.0)] * 60 + [row(True, 30.1)] * 40)
    assert verdict is ClaimVerdict.REFUTED
    assert 0.6 < high < 0.75
