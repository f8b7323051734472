"""Maps and states by their names, learning runs on them, and the table and figure of what was learned."""

import re
from pathlib import Path

import pytest
from threadpoolctl import threadpool_info, threadpool_limits

from palpate.adapters.config.grid import GridLearning
from palpate.adapters.experiments.grid import Panel, Score, learn, learning_figure, summary
from palpate.adapters.experiments.grid.learning import Bounds, bounds_of, grid_named, states_named
from palpate.core.automata import Kind, Machine, to_json_text
from palpate.core.errors import ConfigurationError
from palpate.core.policy import QLearning, Sarsa
from palpate.simulation.grid.maps import SCENARIO_1, GridMap


def test_a_map_is_a_scenario_regions_or_a_file(tmp_path):
    assert grid_named("1", 5) == GridMap.from_regions(SCENARIO_1, 5)
    assert grid_named("ABC/C.E/BDF", 7) == GridMap.from_regions(SCENARIO_1)
    (tmp_path / "map.txt").write_text("AB#\n.BA\n")
    assert grid_named(str(tmp_path / "map.txt"), 7).rows == ("AB#", "·BA")


@pytest.mark.parametrize(
    ("name", "size", "says"),
    [
        ("3", 7, "one of 1, 2, twin, eight regions such as ABC/C.E/BDF, or a text file"),
        ("binary", 7, "no text in UTF-8"),
        ("ABC/CXE/BDF", 7, "three rows of three regions"),
        ("1", 6, "an odd number"),
    ],
)
def test_what_is_no_map_is_refused(name, size, says, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("binary").write_bytes(b"\xff\xfe")
    with pytest.raises(ConfigurationError, match=says):
        grid_named(name, size)


def test_where_the_belief_state_optimum_takes_too_long_there_is_none(monkeypatch):
    def refuse(grid):
        raise ConfigurationError("grid.map", "it", "another")

    monkeypatch.setattr("palpate.adapters.experiments.grid.learning.belief_optimum", refuse)
    assert bounds_of(grid_named("twin", 9)).belief is None


GRID = GridMap.from_text("AB·")
MACHINE = Machine(Kind.MOORE, ("A", "B"), ((0, 1), (0, 1)), ("after A", "after B"))


@pytest.mark.parametrize("cells", ["ABC·", "AC·"])
def test_an_automaton_of_another_map_is_refused(cells, tmp_path):
    path = tmp_path / "automaton.json"
    path.write_text(to_json_text(MACHINE))
    with pytest.raises(ConfigurationError, match="all symbols of the machine and no others: A, B"):
        states_named(str(path), GridMap.from_text(cells))


@pytest.mark.parametrize(
    ("name", "says"),
    [
        ("magic", "state must be symbols, last-2, last-3 and so on, or an automaton file"),
        ("last-0", "last-3 and so on, or an automaton file ending in .json"),
    ],
)
def test_what_gives_no_states_is_refused(name, says):
    with pytest.raises(ConfigurationError, match=says):
        states_named(name, GRID)


REGIONS = GridMap.from_regions(SCENARIO_1, 5)


@pytest.mark.parametrize(("learner", "kind"), [("q", QLearning), ("sarsa", Sarsa)])
def test_equal_seeds_give_equal_runs(learner, kind):
    settings = GridLearning(learner=learner, step_limit=30)
    message = []
    first = learn(REGIONS, states_named("last-2", REGIONS), settings, 4, 40, message.append)
    again = learn(REGIONS, states_named("last-2", REGIONS), settings, 4, 40)
    other = learn(REGIONS, states_named("last-2", REGIONS), settings, 5, 40)
    assert type(first.learner) is kind
    assert (first.walks, first.temperatures, first.learner.q) == (again.walks, again.temperatures, again.learner.q)
    assert first.walks != other.walks
    assert message == list(first.walks)
    assert len(first.steps) == 40
    assert max(first.steps) <= 30
    assert first.temperatures[:2] == (0.5, 0.5 * 0.995)


def test_it_computes_in_one_thread_whatever_else_is_set_and_sets_nothing_for_others():
    def threads():
        return {library["num_threads"] for library in threadpool_info() if library["user_api"] == "blas"}

    seen = []
    with threadpool_limits(limits=2, user_api="blas"):
        learn(REGIONS, states_named("symbols", REGIONS), GridLearning(), 1, 1, lambda walk: seen.append(threads()))
        assert (seen, threads()) == ([{1}], {2})


@pytest.mark.parametrize(
    ("settings", "says"),
    [
        ({"temperature_floor": 2.0}, "temperature_floor must be a number from 0 to temperature, 0.5"),
        ({"alpha": 0.5, "learner": "hmm"}, "alpha must be left out: hmm learns a model, not a table"),
    ],
)
def test_settings_that_do_not_go_together_are_refused_by_the_name_of_their_flag(settings, says):
    with pytest.raises(ConfigurationError) as refused:
        GridLearning(**settings)
    assert str(refused.value).startswith(says)


SCORES = [Score(7, 40.0, 3.5, 1.0), Score(8, 50.0, 4.5, 0.5)]
BOUNDS = Bounds(2.333, 3.208, 48.27)


def test_the_summary_says_the_same_with_intervals():
    figures = summary(SCORES, BOUNDS)
    # t(0.975, 1 degree of freedom) is 12.706, and half the distance of the two is 0.5; steps are not negative.
    assert (figures["mean_last"], figures["mean_last_95"]) == (4.0, [0.0, pytest.approx(4.0 + 12.7062 * 0.5)])
    assert summary(SCORES[:1], BOUNDS)["mean_last_95"] == [None, None]
    assert (figures["full_information"], figures["belief_optimum"]) == (2.333, 3.208)
    assert figures["runs"][1]["reached"] == 0.5
    assert summary(SCORES, Bounds(1.0, None, 9.0))["belief_optimum"] is None


CURVES = tuple(tuple(50 - trial // 4 + run for trial in range(150)) for run in range(3))
PANELS = [
    [Panel(f"scenario {row}, {kind}", CURVES, Bounds(2.33, 3.2, 48.3)) for kind in ("symbols", "automaton")]
    for row in (1, 2)
]


def test_an_svg_has_every_curve_and_is_the_same_again():
    text = learning_figure(PANELS, "svg").decode()
    assert text == learning_figure(PANELS, "svg").decode()
    assert "<dc:date>" not in text
    for colour in ("#0072b2", "#d55e00", "#009e73"):
        assert len(re.findall(f"stroke: {colour}", text)) == 4
