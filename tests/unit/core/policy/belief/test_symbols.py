"""The touch model in symbols: bands of the torque, counted by displacement."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.core.errors import ConfigurationError
from palpate.core.policy.belief.model import SECTORS, Directions
from palpate.core.policy.belief.places import Places
from palpate.core.policy.belief.symbols import SymbolModel, SymbolTable, fit_symbol_model, symbols_of
from palpate.core.policy.belief.touches import Touch, TouchedTrial
from tests.unit.core.policy.belief.simulated_touch import trials

THRESHOLD_NM = 0.006865


def turned(trial: TouchedTrial) -> TouchedTrial:
    """The same trial, turned by a quarter about the origin."""
    touches = tuple(Touch((-t.place[1], t.place[0]), (-t.torque[1], t.torque[0]), t.press) for t in trial.touches)
    return TouchedTrial((-trial.hole[1], trial.hole[0]), touches)


@pytest.mark.parametrize(
    ("torque_Nm", "symbol"), [((-0.01, -0.01), 0), ((0.0, 0.0069), 5), ((0.006865, -0.006865), 4), ((0.01, 0.0), 7)]
)
def test_a_symbol_is_the_band_of_either_component(torque_Nm: tuple[float, float], symbol: int) -> None:
    assert symbols_of(np.array([torque_Nm]), THRESHOLD_NM).tolist() == [symbol]


@settings(max_examples=10, deadline=None)
@given(seed=st.integers(0, 1000))
def test_shares_are_probabilities_and_turn_with_what_was_felt(seed: int) -> None:
    felt = trials(3, seed=seed)
    model, other = (fit_symbol_model(each, THRESHOLD_NM) for each in (felt, [turned(trial) for trial in felt]))
    assert np.allclose(model.shares.sum(axis=2), 1.0)
    assert model.shares.min() > 0.0
    assert model.lag == other.lag
    table = np.arange(9).reshape(3, 3)
    quarter = [int(table[2 - s % 3, s // 3]) for s in range(9)]
    expected = np.roll(model.shares, SECTORS // 4, axis=1)
    assert np.allclose(other.shares[:, :, quarter], expected)


def test_the_symbol_that_is_felt_on_a_side_is_the_likely_one_there() -> None:
    shares = fit_symbol_model(trials(40, seed=8), THRESHOLD_NM).shares
    east = Directions.of(np.array([2e-3]), np.array([0.2e-3]))
    # A hole to the right turns the peg about -y.
    assert east.between_cells(shares)[0].argmax() == symbols_of(np.array([[0.004, -0.022]]), THRESHOLD_NM)[0]


def test_the_belief_is_the_product_of_what_the_table_gives() -> None:
    shares = np.full((10, SECTORS, 9), 0.05)
    shares[:, :3, 3] = 0.6
    belief = SymbolTable(SymbolModel(THRESHOLD_NM, 0.0, shares), Places(1e-3, single=False)).begin(
        np.zeros((21, 21)), 1.0
    )
    belief.feel(10, 10, (0.0, -0.01), 1.0)
    probabilities = belief.probabilities()
    # Twelve times as likely in the quarter to which the symbol belongs as elsewhere.
    assert probabilities[14, 14] == pytest.approx(12.0 * probabilities[6, 14])
    assert probabilities.sum() == pytest.approx(1.0)


def test_too_few_touches_are_refused() -> None:
    with pytest.raises(ConfigurationError, match="at least 6 touches"):
        fit_symbol_model(trials(1, touches=5), THRESHOLD_NM)
