"""The fit of a touch model, on touches of a model that is known."""

from dataclasses import replace

import numpy as np
import pytest

from palpate.core.errors import ConfigurationError
from palpate.core.policy.belief import Directions, TouchedTrial
from palpate.core.policy.belief.fit import fit_touch_model
from tests.unit.core.policy.belief.simulated_touch import CUE_NM, OFFSET_NM, trials


def test_it_finds_cue_offset_and_noise() -> None:
    model = fit_touch_model(trials(60))
    assert model.offset_Nm == pytest.approx(OFFSET_NM, abs=1e-3)
    # At distances that occurred often the torque lies across the heading, to the right of it.
    for along, across in model.cue_Nm[4:8]:
        assert along == pytest.approx(0.0, abs=2e-3)
        assert across == pytest.approx(-CUE_NM, rel=0.1)
    assert np.mean(model.noise_Nm[3:8]) == pytest.approx(0.003, rel=0.25)


def test_it_foretells_touches_that_it_has_not_seen() -> None:
    model, way = fit_touch_model(trials(20)), np.array([[0.001, 0.0], [0.0, -0.002]])
    expected = model.expected_Nm(Directions.of(way[:, 0], way[:, 1]))
    true = np.array([[0.0, -CUE_NM], [-CUE_NM, 0.0]])
    assert expected == pytest.approx(true, abs=3e-3)


def test_the_bias_of_a_trial_is_told_from_noise() -> None:
    rng = np.random.default_rng(5)
    biased = []
    for trial in trials(40):
        dx, dy = (0.01 * rng.standard_normal(2) / 1e-6).round().astype(int).tolist()
        felt = tuple(replace(touch, torque=(touch.torque[0] + dx, touch.torque[1] + dy)) for touch in trial.touches)
        biased.append(TouchedTrial(trial.hole, felt))
    assert fit_touch_model(biased).bias_Nm == pytest.approx(0.01, rel=0.35)
    assert fit_touch_model(trials(40)).bias_Nm < 0.002


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
    assert model.offset_Nm == pytest.approx(OFFSET_NM, abs=1.5e-3)
    assert np.mean([across for _, across in model.cue_Nm[4:8]]) == pytest.approx(-CUE_NM, rel=0.1)


def test_too_few_touches_are_refused() -> None:
    with pytest.raises(ConfigurationError, match="at least 6 touches"):
        fit_touch_model(trials(1, touches=5))


def test_a_trial_that_fell_straight_into_the_hole_changes_nothing() -> None:
    made = trials(5)
    assert fit_touch_model([*made[:2], TouchedTrial((0, 0), ()), *made[2:]]) == fit_touch_model(made)
