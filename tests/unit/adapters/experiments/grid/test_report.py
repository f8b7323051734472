"""Scores, the table with what is possible beside them, and the line for every trial."""

import re

import pytest

from palpate.adapters.config.grid import GridLearning
from palpate.adapters.experiments.grid import Panel, Score, learn, learning_figure, score_table, summary
from palpate.adapters.experiments.grid.worlds import Bounds, bounds_of, states_named
from palpate.simulation.grid.maps import GridMap

GRID = GridMap.from_text("ABC·")
SCORES = [Score(7, 40.0, 3.5, 1.0), Score(8, 50.0, 4.5, 0.5)]
BOUNDS = Bounds(2.333, 3.208, 48.27)


def test_a_run_is_scored():
    run = learn(GRID, states_named("symbols", GRID), GridLearning(alpha=0.5), 0, 300)
    score = Score.of(run)
    assert score.seed == 0
    assert score.first == sum(run.steps[:100]) / 100
    assert score.last == sum(run.steps[-100:]) / 100
    assert score.reached == 1.0
    assert score.last < 2.6


def test_what_is_possible_always_stands_beside_what_was_learned():
    lines = score_table(SCORES, BOUNDS, 1500).splitlines()
    assert lines[0].split("  ")[-1] == "goal reached"
    assert lines[1].split() == ["7", "40.00", "3.50", "100%"]
    assert lines[3].split() == ["mean", "45.00", "4.00", "75%"]
    assert lines[-3:] == [
        "  full information      2.33",
        "  belief-state optimum  3.21",
        "  random walk           48.27",
    ]


def test_one_run_has_no_mean_and_a_short_one_says_how_short():
    text = score_table(SCORES[:1], Bounds(1.0, None, 9.0), 20)
    assert "\nmean" not in text
    assert "last 20" in text
    assert "belief-state optimum  not found" in text


def test_the_summary_says_the_same_with_intervals():
    figures = summary(SCORES, BOUNDS)
    # t(0.975, 1 degree of freedom) is 12.706, and half the distance of the two is 0.5; steps are not negative.
    assert (figures["mean_last"], figures["mean_last_95"]) == (4.0, [0.0, pytest.approx(4.0 + 12.7062 * 0.5)])
    assert summary(SCORES[:1], BOUNDS)["mean_last_95"] == [None, None]
    assert (figures["full_information"], figures["belief_optimum"]) == (2.333, 3.208)
    assert figures["runs"][1]["reached"] == 0.5
    assert summary(SCORES, Bounds(1.0, None, 9.0))["belief_optimum"] is None


def test_bounds_and_scores_agree_on_a_corridor():
    assert bounds_of(GRID).full == bounds_of(GRID).belief == 2.0


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


@pytest.mark.parametrize(("trials", "told"), [(150, True), (20, False)])
def test_the_axis_says_how_many_trials_a_curve_is_the_mean_of(trials, told):
    curves = tuple(steps[:trials] for steps in CURVES)
    text = learning_figure([[Panel("alone", curves, Bounds(1.0, 3.0, 9.0))]], "svg").decode()
    assert ("moving average of 25 trials" in text) == told


@pytest.mark.parametrize("belief", [None, 3.0])
def test_one_panel_alone(belief):
    assert learning_figure([[Panel("alone", CURVES[:1], Bounds(1.0, belief, 9.0))]], "png")
