import numpy as np
import pytest

from palpate.core.policy.belief.fit import fit_touch_model
from palpate.core.policy.belief.lean import LeanModel, fit_lean_model
from palpate.core.policy.belief.lean_belief import LeanTable
from palpate.core.policy.belief.model import RINGS_M, SECTORS
from palpate.core.policy.belief.places import GRADED, Places, TouchTable
from tests.unit.core.policy.belief.simulated_touch import GAINS, expected_Nm, leaning_trials

PLACES = Places(1e-3, single=False)
RINGS = len(RINGS_M)
EVEN = np.zeros((PLACES.size, PLACES.size))


def test_its_evidence_is_the_likelihood_with_every_lean_counted() -> None:
    model = LeanModel(
        0.0, (0.01, -0.02), ((0.001, -0.02),) * RINGS, (((0.0, 0.0),) * SECTORS,) * RINGS, (0.004,) * RINGS, 0.006, 20,
        (GAINS,) * RINGS, 0.03,
    )  # fmt: skip
    felt = [((3, 4), (0.03, -0.01), 1.0), ((5, 15), (-0.02, 0.04), 1.3), ((12, 2), (0.0, 0.02), 0.8)]
    belief = LeanTable(model, PLACES, 0.2).begin(EVEN, 1.0)
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
            covariance = spread**2 * seen @ seen.T + 0.004**2 * np.eye(6)
            off = left - seen @ mean
            likely += share * np.exp(-0.5 * off @ np.linalg.solve(covariance, off)) / np.sqrt(np.linalg.det(covariance))
        rows.append((belief.evidence()[hole], np.log(likely)))
    ours, true = np.array(rows).T
    assert ours - ours[0] == pytest.approx(true - true[0], abs=1e-4)


def test_a_tool_that_was_gripped_anew_is_noticed_in_the_trial() -> None:
    rng, felt, hole = np.random.default_rng(1), leaning_trials([(0.03, 0.01)] * 30), np.array((15, 12))
    tables = LeanTable(fit_lean_model(felt), PLACES, 0.05), TouchTable(fit_touch_model(felt), PLACES)
    beliefs = [table.begin(EVEN, 1.0) for table in tables]
    for cell in ((3, 9), (6, 2), (10, 5), (8, 16), (13, 3)):
        torque = expected_Nm((hole - cell) * 1e-4, np.array((-0.02, 0.03))) + 0.003 * rng.standard_normal(2)
        for belief in beliefs:
            belief.feel(*cell, (float(torque[0]), float(torque[1])), 1.0)
    likeliest = [np.unravel_index(np.argmax(belief.probabilities()), EVEN.shape) for belief in beliefs]
    off = [float(np.hypot(*(hole - cell))) for cell in likeliest]
    assert off[0] <= 3.0 < off[1]


def test_in_single_precision_it_believes_the_same() -> None:
    rng, hole = np.random.default_rng(2), np.array((15, 12))
    model, beliefs = fit_lean_model(leaning_trials([(0.03, 0.01)] * 30)), []
    for single in (False, True):
        places = Places(1e-3, single=single)
        beliefs.append(LeanTable(model, places, 0.05).begin(EVEN.astype(places.dtype), 0.985))
    for _ in range(40):
        cell = rng.integers(0, PLACES.size, 2)
        felt_Nm = expected_Nm((hole - cell) * 1e-4, np.array((-0.02, 0.03))) + 0.01 * rng.standard_normal(2)
        for belief in beliefs:
            belief.feel(int(cell[0]), int(cell[1]), (float(felt_Nm[0]), float(felt_Nm[1])), 1.1)
        double, single = (belief.probabilities() for belief in beliefs)
        assert single.dtype == np.float32
        assert np.abs(single - double).max() < 1e-3 * double.max()
        by_evidence = np.exp(beliefs[1].evidence() - beliefs[1].evidence().max())
        assert np.abs(by_evidence / by_evidence.sum() - double).max() < 1e-3 * double.max()


def test_a_place_is_missed_the_less_the_further_off_the_way_was() -> None:
    belief, off_m2 = LeanTable(fit_lean_model(leaning_trials([(0.0, 0.0)])), PLACES, 0.05).begin(EVEN, 1.0), EVEN.copy()
    off_m2[:] = np.square(PLACES.axis_m)[:, None]
    for widths, log_weight in GRADED:
        belief.passed = belief.passed + np.where(off_m2 <= np.square(widths * 1.5e-4), log_weight, 0.0)
    left = belief.probabilities()[10:, 0] / belief.probabilities()[-1, 0]
    assert left[:4] == pytest.approx([0.1485, 0.33, 0.6, 1.0])
