"""Exponential and logarithm of equal bits, the fit of a contact model, and the belief by it."""

from dataclasses import replace

import numpy as np
import pytest

from palpate.core.errors import ConfigurationError
from palpate.core.policy.belief import ContactModel, ContactTrial, Directions
from palpate.core.policy.belief.arithmetic import exponential, logarithm
from palpate.core.policy.belief.fit import fit_contact_model
from palpate.core.policy.belief.model import RINGS_M, SECTORS
from palpate.core.policy.belief.place_belief import ContactTable, PlaceBelief
from palpate.core.policy.belief.places import SINGLE, Places
from tests.unit.core.policy.belief.simulated_contact import (
    CUE_NM,
    GAINS,
    OFFSET_NM,
    expected_Nm,
    leaning_trials,
    trials,
)

EXPONENTIALS = "9922d5996df4ec3fb8615fc08503b53f949db5b95b16ef3c"
LOGARITHMS = "9521b5bbb16b02c07612e0f04052ed3fb27532ad610b0c40"
SINGLE_EXPONENTIALS = "6da3673f291ca83deab27827"
SINGLE_LOGARITHMS = "8e5d13c008926a3f0d5b6040"


class TestArithmetic:
    def test_the_exponential_is_close_to_numpys(self):
        x = np.linspace(-690.0, 5.0, 20_001)
        assert np.abs(exponential(x) / np.exp(x) - 1.0).max() < 2e-7

    def test_what_is_far_below_zero_is_nothing_and_no_error(self):
        assert exponential(np.array([-1e9, -701.0])) == pytest.approx([0.0, 0.0], abs=1e-300)

    def test_the_logarithm_is_close_to_numpys(self):
        x = np.exp(np.linspace(-60.0, 60.0, 20_001))
        assert np.abs(logarithm(x) - np.log(x)).max() < 2e-7

    def test_both_are_close_in_single_precision(self):
        x = np.linspace(-59.0, 5.0, 20_001)
        assert (
            np.abs(exponential(x.astype(np.float32)) / np.exp(x.astype(np.float32).astype(np.float64)) - 1.0).max()
            < 5e-6
        )
        y = np.exp(np.linspace(-30.0, 30.0, 20_001)).astype(np.float32)
        assert np.abs(logarithm(y) - np.log(y.astype(np.float64))).max() < 3e-6
        assert exponential(np.array([-1e9], np.float32)) == pytest.approx([0.0], abs=1e-26)

    def test_both_give_the_bytes_that_they_gave_before(self):
        # Of sums, products and powers of two alone: no processor may round them in another way.
        assert exponential(np.array([-0.1, -2.5, -33.3])).tobytes().hex() == EXPONENTIALS
        assert logarithm(np.array([0.1, 2.5, 33.3])).tobytes().hex() == LOGARITHMS
        assert exponential(np.array([-0.1, -2.5, -33.3], np.float32)).tobytes().hex() == SINGLE_EXPONENTIALS
        assert logarithm(np.array([0.1, 2.5, 33.3], np.float32)).tobytes().hex() == SINGLE_LOGARITHMS


WAYS_M = np.array([(0.0015, 0.0005), (-0.0015, 0.0005), (0.0005, -0.002)])


def foretold_Nm(model):
    at = Directions.of(WAYS_M[:, 0], WAYS_M[:, 1])
    tilt = at.turned_back(np.broadcast_to(model.offset_Nm, at.unit.shape))
    return model.upright_Nm(at) + at.turned(at.between(np.array(model.gain)) * tilt) + model.offset_Nm


class TestFit:
    def test_it_finds_cue_and_noise(self):
        model = fit_contact_model(trials(60))
        # At distances that occurred often the torque lies across the heading, to the right of it.
        for along, across in model.cue_Nm[4:8]:
            assert along == pytest.approx(0.0, abs=2e-3)
            assert across == pytest.approx(-CUE_NM, rel=0.1)
        assert np.mean(model.noise_Nm[3:8]) == pytest.approx(0.003, rel=0.25)

    def test_the_bias_of_a_trial_is_told_from_noise(self):
        rng = np.random.default_rng(5)
        biased = []
        for trial in trials(40):
            dx, dy = (0.01 * rng.standard_normal(2) / 1e-6).round().astype(int).tolist()
            felt = tuple(
                replace(touch, torque=(touch.torque[0] + dx, touch.torque[1] + dy)) for touch in trial.contacts
            )
            biased.append(ContactTrial(trial.hole, felt))
        assert fit_contact_model(biased).bias_Nm == pytest.approx(0.01, rel=0.35)
        assert fit_contact_model(trials(40)).bias_Nm < 0.003

    def test_a_cue_grows_with_the_load_and_an_offset_does_not(self):
        rng, loaded = np.random.default_rng(6), []
        for trial in trials(40):
            loads = rng.uniform(0.5, 1.3, len(trial.contacts))
            felt = tuple(
                replace(
                    touch,
                    press=round(4900 * load),
                    torque=tuple(
                        round(o / 1e-6 + load * (t - o / 1e-6)) for t, o in zip(touch.torque, OFFSET_NM, strict=True)
                    ),
                )
                for touch, load in zip(trial.contacts, loads.tolist(), strict=True)
            )
            loaded.append(replace(trial, contacts=felt))
        model = fit_contact_model(loaded)
        true = [np.array((y, -x)) * CUE_NM / np.hypot(x, y) + OFFSET_NM for x, y in WAYS_M]
        assert foretold_Nm(model) == pytest.approx(np.array(true), abs=4e-3)
        assert np.mean([across for _, across in model.cue_Nm[4:8]]) == pytest.approx(-CUE_NM, rel=0.1)

    def test_too_few_touches_are_refused(self):
        with pytest.raises(ConfigurationError, match="at least 6 contacts"):
            fit_contact_model(trials(1, contacts=5))

    def test_a_trial_that_fell_straight_into_the_hole_changes_nothing(self):
        made = trials(5)
        assert fit_contact_model([*made[:2], ContactTrial((0, 0), ()), *made[2:]]) == fit_contact_model(made)

    def test_gains_are_found_from_grips_that_differ(self):
        rng = np.random.default_rng(2)
        model = fit_contact_model(leaning_trials([(x, y) for x, y in 0.03 * rng.standard_normal((30, 2))]))
        # How large a lean is, is a matter of definition; how much more of it there is along the heading is not.
        along, across = 1.0 + np.array(model.gain)[4:7].T
        assert along / across == pytest.approx((1.0 + GAINS[0]) / (1.0 + GAINS[1]), rel=0.15)


PLACES = Places(1e-3)
RINGS = len(RINGS_M)
EVEN = np.zeros((PLACES.size, PLACES.size), SINGLE)


class TestPlaceBelief:
    def test_its_evidence_is_the_likelihood_with_every_lean_counted(self):
        cue, residual = ((0.001, -0.02),) * RINGS, (((0.0, 0.0),) * SECTORS,) * RINGS
        model = ContactModel(0.0, (0.01, -0.02), cue, residual, (0.02,) * RINGS, 0.006, 20, (GAINS,) * RINGS, 0.03)
        felt = [((3, 4), (0.03, -0.01), 1.0), ((5, 15), (-0.02, 0.04), 1.3), ((12, 2), (0.0, 0.02), 0.8)]
        belief = PlaceBelief(ContactTable(model, PLACES, 0.2), EVEN, 1.0)
        for (row, column), torque, load in felt:
            belief.feel(row, column, torque, load)
        rows = []
        for hole in ((0, 0), (10, 11), (20, 7)):
            ways = [np.array(hole, dtype=float) - cell for cell, _, _ in felt]
            units = [way / np.hypot(*way) for way in ways]
            axes = [np.array([[u, -v], [v, u]]) for u, v in units]
            seen = np.vstack(
                [a @ np.diag(1.0 + load * np.array(GAINS)) @ a.T for a, (_, _, load) in zip(axes, felt, strict=True)]
            )
            cue = np.concatenate([load * a @ (0.001, -0.02) for a, (_, _, load) in zip(axes, felt, strict=True)])
            left = np.concatenate([torque for _, torque, _ in felt]) - cue
            likely = 0.0
            for share, mean, spread in ((0.8, (0.01, -0.02), 0.006), (0.2, (0.0, 0.0), 0.03)):
                covariance = spread**2 * seen @ seen.T + 0.02**2 * np.eye(6)
                off = left - seen @ mean
                likely += (
                    share * np.exp(-0.5 * off @ np.linalg.solve(covariance, off)) / np.sqrt(np.linalg.det(covariance))
                )
            rows.append((belief.probabilities()[hole], likely))
        ours, true = np.array(rows).T
        assert ours / ours[0] == pytest.approx(true / true[0], rel=2e-3)

    def test_a_tool_that_was_gripped_anew_is_noticed_in_the_trial(self):
        rng, felt, hole = np.random.default_rng(1), leaning_trials([(0.03, 0.01)] * 30), np.array((15, 12))
        model = fit_contact_model(felt)
        # To the second no other lean is believable.
        models = model, replace(model, spread_Nm=model.bias_Nm)
        beliefs = [PlaceBelief(ContactTable(each, PLACES, 0.05), EVEN, 1.0) for each in models]
        for cell in ((3, 9), (6, 2), (10, 5), (8, 16), (13, 3)):
            torque = expected_Nm((hole - cell) * 1e-4, np.array((-0.02, 0.03))) + 0.003 * rng.standard_normal(2)
            for belief in beliefs:
                belief.feel(*cell, (float(torque[0]), float(torque[1])), 1.0)
        likeliest = [np.unravel_index(np.argmax(belief.probabilities()), EVEN.shape) for belief in beliefs]
        off = [float(np.hypot(*(hole - cell))) for cell in likeliest]
        assert off[0] <= 3.0 < off[1]
