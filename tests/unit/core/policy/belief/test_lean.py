"""The touch model of a tool that leans, on touches of one that is known."""

from dataclasses import replace

import numpy as np
import pytest

from palpate.core.policy.belief.lean import LeanModel, fit_lean_model
from palpate.core.policy.belief.model import Directions
from tests.unit.core.policy.belief.simulated_touch import CUE_NM, GAINS, OFFSET_NM, expected_Nm, leaning_trials, trials

WAYS_M = np.array([(0.0015, 0.0005), (-0.0015, 0.0005), (0.0005, -0.002)])
LEAN = (0.03, 0.01)


def foretold_Nm(model: LeanModel) -> np.ndarray:
    torque: np.ndarray = model.expected_Nm(Directions.of(WAYS_M[:, 0], WAYS_M[:, 1])) + model.offset_Nm
    return torque


def test_what_one_grip_shows_holds_for_the_next() -> None:
    model = fit_lean_model(leaning_trials([LEAN] * 20))
    x, y = model.offset_Nm
    true = [expected_Nm(way, np.array((-LEAN[1], LEAN[0]))) for way in WAYS_M]
    assert foretold_Nm(replace(model, offset_Nm=(-y, x))) == pytest.approx(np.array(true), abs=7e-3)


def test_gains_are_found_from_grips_that_differ() -> None:
    rng = np.random.default_rng(2)
    model = fit_lean_model(leaning_trials([(x, y) for x, y in 0.03 * rng.standard_normal((30, 2))]))
    # How large a lean is, is a matter of definition; how much more of it there is along the heading is not.
    along, across = 1.0 + np.array(model.gain)[4:7].T
    assert along / across == pytest.approx((1.0 + GAINS[0]) / (1.0 + GAINS[1]), rel=0.15)


def test_the_lean_to_be_expected_is_that_of_the_last_grip() -> None:
    model = fit_lean_model(leaning_trials([LEAN] * 10 + [(-0.02, 0.02)] * 12))
    true = [expected_Nm(way, np.array((-0.02, 0.02))) for way in WAYS_M]
    assert foretold_Nm(model) == pytest.approx(np.array(true), abs=5e-3)


def test_of_an_upright_tool_it_foretells_cue_and_offset() -> None:
    model = fit_lean_model(trials(40))
    true = [np.array((y, -x)) * CUE_NM / np.hypot(x, y) + OFFSET_NM for x, y in WAYS_M]
    assert foretold_Nm(model) == pytest.approx(np.array(true), abs=4e-3)
    assert model.bias_Nm < 0.003
