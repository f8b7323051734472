"""What of a learning curve is shown while it grows."""

from palpate.adapters.experiments import WINDOW
from palpate.adapters.visualisation.live.display import LearningSoFar


def test_an_average_is_shown_only_of_as_many_trials_as_it_goes_over() -> None:
    curve = LearningSoFar()
    for trial in range(WINDOW + 1):
        curve.add(trial, 26.0 if trial == 0 else 1.0, success=True, peak_N=5.0)
    assert curve.averages_s == [*[None] * (WINDOW - 1), 2.0, 1.0]
