"""The fit of a touch model, on touches of a model that is known."""

from dataclasses import replace

import numpy as np
import pytest

from palpate.core.errors import ConfigurationError
from palpate.core.policy.belief import Directions, TouchedTrial, TouchModel
from palpate.core.policy.belief.fit import fit_touch_model
from tests.unit.core.policy.belief.simulated_touch import CUE_NM, GAINS, OFFSET_NM, expected_Nm, leaning_trials, trials

WAYS_M = np.array([(0.0015, 0.0005), (-0.0015, 0.0005), (0.0005, -0.002)])
LEAN = (0.03, 0.01)


def foretold_Nm(model: TouchModel) -> np.ndarray:
    torque: np.ndarray = model.expected_Nm(Directions.of(WAYS_M[:, 0], WAYS_M[:, 1])) + model.offset_Nm
    return torque


def test_it_finds_cue_and_noise() -> None:
    model = fit_touch_model(trials(60))
    # At distances that occurred often the torque lies across the heading, to the right of it.
    for along, across in model.cue_Nm[4:8]:
        assert along == pytest.approx(0.0, abs=2e-3)
        assert across == pytest.approx(-CUE_NM, rel=0.1)
    assert np.mean(model.noise_Nm[3:8]) == pytest.approx(0.003, rel=0.25)


def test_the_bias_of_a_trial_is_told_from_noise() -> None:
    rng = np.random.default_rng(5)
    biased = []
    for trial in trials(40):
        dx, dy = (0.01 * rng.standard_normal(2) / 1e-6).round().astype(int).tolist()
        felt = tuple(replace(touch, torque=(touch.torque[0] + dx, touch.torque[1] + dy)) for touch in trial.touches)
        biased.append(TouchedTrial(trial.hole, felt))
    assert fit_touch_model(biased).bias_Nm == pytest.approx(0.01, rel=0.35)
    assert fit_touch_model(trials(40)).bias_Nm < 0.003


def test_a_cue_grows_with_the_load_and_an_offset_does_not() -> None:
    rng, loaded = np.random.default_rng(6), []
    for trial in trials(40):
        loads = rng.uniform(0.5, 1.3, len(trial.touches))
        felt = tuple(
            replace(
                touch,
                press=round(4900 * load),
                torque=tuple(
                    round(o / 1e-6 + load * (t - o / 1e-6)) for t, o in zip(touch.torque, OFFSET_NM, strict=True)
                ),
            )
            for touch, load in zip(trial.touches, loads.tolist(), strict=True)
        )
        loaded.append(replace(trial, touches=felt))
    model = fit_touch_model(loaded)
    true = [np.array((y, -x)) * CUE_NM / np.hypot(x, y) + OFFSET_NM for x, y in WAYS_M]
    assert foretold_Nm(model) == pytest.approx(np.array(true), abs=4e-3)
    assert np.mean([across for _, across in model.cue_Nm[4:8]]) == pytest.approx(-CUE_NM, rel=0.1)


def test_too_few_touches_are_refused() -> None:
    with pytest.raises(ConfigurationError, match="at least 6 touches"):
        fit_touch_model(trials(1, touches=5))


def test_a_trial_that_fell_straight_into_the_hole_changes_nothing() -> None:
    made = trials(5)
    assert fit_touch_model([*made[:2], TouchedTrial((0, 0), ()), *made[2:]]) == fit_touch_model(made)


def test_what_one_grip_shows_holds_for_the_next() -> None:
    model = fit_touch_model(leaning_trials([LEAN] * 20))
    x, y = model.offset_Nm
    true = [expected_Nm(way, np.array((-LEAN[1], LEAN[0]))) for way in WAYS_M]
    assert foretold_Nm(replace(model, offset_Nm=(-y, x))) == pytest.approx(np.array(true), abs=7e-3)


def test_gains_are_found_from_grips_that_differ() -> None:
    rng = np.random.default_rng(2)
    model = fit_touch_model(leaning_trials([(x, y) for x, y in 0.03 * rng.standard_normal((30, 2))]))
    # How large a lean is, is a matter of definition; how much more of it there is along the heading is not.
    along, across = 1.0 + np.array(model.gain)[4:7].T
    assert along / across == pytest.approx((1.0 + GAINS[0]) / (1.0 + GAINS[1]), rel=0.15)


def test_the_lean_to_be_expected_is_that_of_the_last_grip() -> None:
    model = fit_touch_model(leaning_trials([LEAN] * 10 + [(-0.02, 0.02)] * 12))
    true = [expected_Nm(way, np.array((-0.02, 0.02))) for way in WAYS_M]
    assert foretold_Nm(model) == pytest.approx(np.array(true), abs=5e-3)


def test_of_an_upright_tool_it_foretells_cue_and_offset() -> None:
    model = fit_touch_model(trials(40))
    true = [np.array((y, -x)) * CUE_NM / np.hypot(x, y) + OFFSET_NM for x, y in WAYS_M]
    assert foretold_Nm(model) == pytest.approx(np.array(true), abs=4e-3)
    assert model.bias_Nm < 0.003
