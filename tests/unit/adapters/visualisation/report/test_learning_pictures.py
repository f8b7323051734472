"""Learning curves: means and bands are what they are said to be."""

import numpy as np
import pytest

from palpate.adapters.visualisation.report.canvas import COLOURS
from palpate.adapters.visualisation.report.learning_pictures import (
    LearningCurve,
    ReferenceLevel,
    learning_picture,
    means_of,
    window_of,
)
from tests.unit.adapters.visualisation.report.samples import pixels


def curve(*runs: tuple[float, ...], label: str = "q-learning") -> LearningCurve:
    return LearningCurve(label, runs, tuple((True,) * len(run) for run in runs))


def pale(png: bytes, colour: str = COLOURS[0]) -> int:
    """How many pixels have the colour of a band: a fifth of it over white."""
    wanted = 255 - 0.2 * (255 - np.array([int(colour[k : k + 2], 16) for k in (1, 3, 5)]))
    return int((np.abs(pixels(png) - wanted).max(axis=-1) <= 2).sum())


@pytest.mark.parametrize(("trials", "window"), [(1, 1), (24, 1), (25, 25), (350, 25)])
def test_window(trials: int, window: int) -> None:
    assert window_of(trials) == window


def test_means_are_moving_averages_of_each_run() -> None:
    means = means_of([(26.0, *[1.0] * 25, 9.0), (1.0,) * 26], 26)
    assert means[0, [0, 24, 25]].tolist() == [26.0, pytest.approx(2.0), pytest.approx(1.0)]
    assert means[1].tolist() == [1.0] * 26


def test_fewer_trials_than_an_average_takes_stand_for_themselves() -> None:
    assert means_of([(4.0, 2.0, 0.0)], 3).tolist() == [[4.0, 2.0, 0.0]]
    few, many = (learning_picture("l", [curve((2.0,) * trials)]).caption for trials in (24, 25))
    assert "trial by trial" in few
    assert "average" not in few
    assert "moving average over the last 25 trials" in many


def test_a_band_only_over_several_seeds() -> None:
    one = learning_picture("learning", [curve((5.0, 4.0, 3.0, 3.0))])
    three = learning_picture("learning", [curve((5.0, 4.0, 3.0, 3.0), (6.0, 5.0, 3.5, 2.5), (4.0, 4.5, 3.0, 3.5))])
    assert pale(one.png) < 50
    assert pale(three.png) > 2000
    assert "no interval over seeds" in one.caption
    assert "Student's t over seeds" in three.caption
    assert "mean of 3 seeds" in three.caption


def test_failures_are_marked_and_successes_too() -> None:
    mixed = learning_picture("l", [LearningCurve("a", ((2.0, 9.0, 2.0, 9.0),), ((True, False, True, False),))])
    good = learning_picture("l", [LearningCurve("a", ((2.0, 9.0, 2.0, 9.0),), ((True, True, True, True),))])
    orange = [(np.ptp(pixels(p.png), axis=-1) > 60) & (pixels(p.png)[..., 0] > 200) for p in (mixed, good)]
    assert orange[0].sum() > 20
    assert orange[1].sum() == 0


def test_words_say_what_is_to_be_seen() -> None:
    picture = learning_picture("learning", [curve((8.0, 4.0, 2.0, 2.0, 2.0))], [ReferenceLevel("torque", 0.75, 1.0)])
    assert "q-learning: 8 s after 1 trial, 2 s at trial 4, success 100 % there" in picture.alt
    assert "torque: 0.75 s" in picture.alt
    assert "Trials that fail count with the time they took." in picture.caption
