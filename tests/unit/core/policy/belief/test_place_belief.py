from dataclasses import replace

import numpy as np
import pytest

from palpate.core.policy.belief.fit import fit_touch_model
from palpate.core.policy.belief.model import RINGS_M, SECTORS, TouchModel
from palpate.core.policy.belief.place_belief import MISSED, PlaceBelief, TouchTable
from palpate.core.policy.belief.places import SINGLE, Places, off_way_m2
from tests.unit.core.policy.belief.simulated_touch import GAINS, expected_Nm, leaning_trials

PLACES = Places(1e-3)
RINGS = len(RINGS_M)
EVEN = np.zeros((PLACES.size, PLACES.size), SINGLE)


def test_its_evidence_is_the_likelihood_with_every_lean_counted() -> None:
    model = TouchModel(
        0.0, (0.01, -0.02), ((0.001, -0.02),) * RINGS, (((0.0, 0.0),) * SECTORS,) * RINGS, (0.02,) * RINGS, 0.006, 20,
        (GAINS,) * RINGS, 0.03,
    )  # fmt: skip
    felt = [((3, 4), (0.03, -0.01), 1.0), ((5, 15), (-0.02, 0.04), 1.3), ((12, 2), (0.0, 0.02), 0.8)]
    belief = PlaceBelief(TouchTable(model, PLACES, 0.2), EVEN, 1.0)
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
            likely += share * np.exp(-0.5 * off @ np.linalg.solve(covariance, off)) / np.sqrt(np.linalg.det(covariance))
        rows.append((belief.probabilities()[hole], likely))
    ours, true = np.array(rows).T
    assert ours / ours[0] == pytest.approx(true / true[0], rel=2e-3)


def test_a_tool_that_was_gripped_anew_is_noticed_in_the_trial() -> None:
    rng, felt, hole = np.random.default_rng(1), leaning_trials([(0.03, 0.01)] * 30), np.array((15, 12))
    model = fit_touch_model(felt)
    # To the second no other lean is believable.
    models = model, replace(model, spread_Nm=model.bias_Nm)
    beliefs = [PlaceBelief(TouchTable(each, PLACES, 0.05), EVEN, 1.0) for each in models]
    for cell in ((3, 9), (6, 2), (10, 5), (8, 16), (13, 3)):
        torque = expected_Nm((hole - cell) * 1e-4, np.array((-0.02, 0.03))) + 0.003 * rng.standard_normal(2)
        for belief in beliefs:
            belief.feel(*cell, (float(torque[0]), float(torque[1])), 1.0)
    likeliest = [np.unravel_index(np.argmax(belief.probabilities()), EVEN.shape) for belief in beliefs]
    off = [float(np.hypot(*(hole - cell))) for cell in likeliest]
    assert off[0] <= 3.0 < off[1]


def test_a_place_is_missed_the_less_the_further_off_the_way_was() -> None:
    table = TouchTable(fit_touch_model(leaning_trials([(0.0, 0.0)])), PLACES, 0.05)
    belief, off_m2 = PlaceBelief(table, EVEN, 1.0), EVEN.copy()
    off_m2[:] = np.square(PLACES.axis_m)[:, None]
    for widths, log_weight in MISSED:
        belief.passed = belief.passed + np.where(off_m2 <= np.square(widths * 1.5e-4), log_weight, 0.0)
    left = belief.probabilities()[10:, 0] / belief.probabilities()[-1, 0]
    assert left[:4] == pytest.approx([0.1485, 0.33, 0.6, 1.0])


def test_what_is_near_a_way_lies_in_its_box_beyond_the_edge_too() -> None:
    rng = np.random.default_rng(3)
    for start, way in rng.uniform(-1.4e-3, 1.4e-3, (200, 2, 2)).round(4):
        box, off_m2 = PLACES.near_way(tuple(start), tuple(way), 2e-4)
        x, y = PLACES.axis_m[:, None] - start[0], PLACES.axis_m[None, :] - start[1]
        everywhere_m2 = off_way_m2(x, y, *way)
        assert np.array_equal(everywhere_m2[box], off_m2)
        everywhere_m2[box] = np.inf
        assert everywhere_m2.min() > 2e-4**2
