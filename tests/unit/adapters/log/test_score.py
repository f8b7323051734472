"""The public score sheet, on golden logs and on a motion with a known jerk."""

from dataclasses import astuple

import numpy as np
import pytest

from palpate.adapters.log import read_log, score_of
from palpate.adapters.log.score import mean_jerk_m_s3
from tests.golden.record import HERE


def scored(name):
    return score_of(read_log(HERE / f"{name}.mcap"))


def test_an_insertion_has_75_points_and_nearly_all_others():
    trial = scored("corner-first")
    points = trial.score
    assert (points.valid, points.success, points.duration, points.force) == (1.0, 75.0, 12.0, 0.0)
    assert 0.0 < points.smoothness < 6.0
    assert 5.0 < points.efficiency < 6.0
    assert points.total == pytest.approx(sum(astuple(points)))
    assert trial.basis == "truth"


def test_a_wedged_peg_has_points_for_its_depth():
    log = read_log(HERE / "wedged.mcap")
    assert score_of(log).score.success == pytest.approx(38.0 + 12.0 * log.end.true_depth_m / 10e-3, abs=0.01)


def test_a_peg_next_to_the_hole_has_points_for_its_distance():
    assert 0.0 < scored("fault-inverted").score.success < 25.0


def test_a_trial_far_from_the_hole_has_none_for_its_motion():
    assert scored("trip-and-hold").score.total == 1.0


@pytest.mark.parametrize("jerk_m_s3", [2.0, 40.0])
def test_jerk_is_that_of_the_motion_while_it_moves(jerk_m_s3):
    time_s = np.arange(280) / 140.0
    moving_s = np.maximum(time_s - 0.5, 0.0)
    tip_m = np.stack([jerk_m_s3 * moving_s**3 / 6.0, 0.0 * time_s, 0.0 * time_s], axis=1)
    # Encoders at half the rate of the loop.
    assert mean_jerk_m_s3(np.repeat(tip_m[::2], 2, axis=0), time_s) == pytest.approx(jerk_m_s3, rel=0.1)
