"""Learning runs: settings, repeatability, and what is remembered of each trial."""

import pytest
from threadpoolctl import threadpool_info, threadpool_limits

from palpate.adapters.config.grid import GridLearning
from palpate.adapters.experiments.grid import learn, states_named
from palpate.core.errors import ConfigurationError
from palpate.core.policy import QLearning, QParameters, Sarsa, SarsaParameters, TemperatureSchedule
from palpate.simulation.grid import GridMap
from palpate.simulation.grid.maps import SCENARIO_1

GRID = GridMap.from_regions(SCENARIO_1, 5)


def test_settings_become_those_of_the_learner():
    schedule = TemperatureSchedule(2.0, 0.9, 0.5)
    common = {"alpha": 0.3, "gamma": 1.0, "alpha_visits": 0.0, "alpha_floor": 0.0}
    flags = {"alpha": 0.3, "temperature": 2.0, "temperature_decay": 0.9, "temperature_floor": 0.5, "trace_decay": 0.4}
    assert GridLearning(**flags).parameters() == QParameters(**common, temperature=schedule, initial_value=-4.0)
    assert GridLearning(**flags, learner="sarsa").parameters() == SarsaParameters(
        **common, temperature=schedule, trace_decay=0.4
    )
    own = GridLearning().parameters()
    assert (own.alpha, own.alpha_visits, own.alpha_floor) == (0.5, 20.0, 0.05)
    given = [GridLearning(alpha=0.2), GridLearning(learner="sarsa")]
    assert [(s.parameters().alpha, s.parameters().alpha_visits) for s in given] == [(0.2, 0.0), (0.1, 0.0)]


@pytest.mark.parametrize(("learner", "kind"), [("q", QLearning), ("sarsa", Sarsa)])
def test_equal_seeds_give_equal_runs(learner, kind):
    settings = GridLearning(learner=learner, step_limit=30)
    told = []
    first = learn(GRID, states_named("last-2", GRID), settings, 4, 40, told.append)
    again = learn(GRID, states_named("last-2", GRID), settings, 4, 40)
    other = learn(GRID, states_named("last-2", GRID), settings, 5, 40)
    assert type(first.learner) is kind
    assert (first.walks, first.temperatures, first.learner.q) == (again.walks, again.temperatures, again.learner.q)
    assert first.walks != other.walks
    assert told == list(first.walks)
    assert len(first.steps) == 40
    assert max(first.steps) <= 30
    assert first.temperatures[:2] == (0.5, 0.5 * 0.995)


def test_it_computes_in_one_thread_whatever_else_is_set_and_sets_nothing_for_others():
    def threads():
        return {library["num_threads"] for library in threadpool_info() if library["user_api"] == "blas"}

    seen = []
    with threadpool_limits(limits=2, user_api="blas"):
        learn(GRID, states_named("symbols", GRID), GridLearning(), 1, 1, lambda walk: seen.append(threads()))
        assert (seen, threads()) == ([{1}], {2})


def test_a_shorter_run_is_the_beginning_of_a_longer_one():
    short, long = (learn(GRID, states_named("symbols", GRID), GridLearning(), 1, trials) for trials in (20, 60))
    assert long.walks[:20] == short.walks


@pytest.mark.parametrize(
    ("settings", "says"),
    [
        ({"temperature_floor": 2.0}, "temperature_floor = 2"),
        ({"alpha": 0.5, "learner": "hmm"}, "alpha = 0.5 is refused: none; hmm learns a model, not a table"),
    ],
)
def test_settings_that_do_not_go_together_are_refused_by_the_name_of_their_flag(settings, says):
    with pytest.raises(ConfigurationError) as refused:
        GridLearning(**settings)
    assert str(refused.value).startswith(says)
