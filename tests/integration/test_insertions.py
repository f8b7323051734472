"""Whole trials in the simulated cell: each learner learns, and a rule inserts whatever the poses of a job are."""

from statistics import median

import pytest

from palpate.adapters.config import compose
from palpate.adapters.experiments import Run


def exploration_s(learner, scenario, trials, out):
    """Times of exploration of a training; a failure counts 20 s."""
    rows = Run(scenario=scenario, learner=learner, settings={"seed": 8101}).train(trials, out).rows
    return [row.exploration_time_s if row.success else 20.0 for row in rows]


@pytest.mark.parametrize(
    ("learner", "scenario", "trials", "first", "last"),
    [
        ("belief", "blind", 5, 1, 3),
        # Minutes: these run in `make nightly`.
        pytest.param("q-learning", "paper", 60, 20, 20, marks=pytest.mark.nightly),
        pytest.param("sarsa", "paper", 60, 20, 20, marks=pytest.mark.nightly),
    ],
)
def test_later_trials_take_half_the_time(learner, scenario, trials, first, last, tmp_path):
    times_s = exploration_s(learner, scenario, trials, tmp_path)
    assert median(times_s[-last:]) <= 0.5 * median(times_s[:first]), times_s


@pytest.mark.parametrize(
    ("tool", "place"),
    [
        ({"sensor_rpy_deg": (0.0, 0.0, 30.0)}, {}),
        ({"tip_rpy_deg": (0.0, 10.0, 0.0), "tip_mm": (20.0, 0.0, 130.0)}, {}),
        pytest.param({"tip_mm": (0.0, 0.0, 250.0)}, {"z_mm": 0.0}, marks=pytest.mark.nightly),
        pytest.param({}, {"rpy_deg": (20.0, 0.0, 0.0)}, marks=pytest.mark.nightly),
        ({}, {"rpy_deg": (0.0, 90.0, 0.0), "x_mm": 500.0, "z_mm": 300.0}),
    ],
    ids=["turned sensor", "bent tool", "long tool", "inclined plate", "hole in a wall"],
)
def test_torque_rule_inserts_whatever_the_poses_are(tool, place):
    config = compose("job", "q-learning", {"arm": "ur10"}, job={"part": {}, "tool": tool, "place": place})
    assert [row.success for row in Run(config).evaluate(2, "torque").rows] == [True, True]
