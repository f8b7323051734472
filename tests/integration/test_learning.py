"""Each learner of the insertion learns: whole trials in the simulated cell, from nothing."""

from statistics import median

import pytest

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
