"""Exact costs of fixed policies, held against hand computation, simulation and the belief-state optimum."""

from dataclasses import replace
from math import inf

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.core.automata import AutomatonState, Kind, Machine
from palpate.core.errors import ConfigurationError
from palpate.core.perception import IdentityState, LastSymbols
from palpate.core.policy import QLearning, QParameters, TemperatureSchedule
from palpate.simulation.grid import chain
from palpate.simulation.grid.chain import ExpectedSteps, expected_steps, greedy, uniform
from palpate.simulation.grid.maps import SCENARIOS, GridMap, grid_actions
from palpate.simulation.grid.optimum import belief_optimum
from palpate.simulation.grid.trial import run_trial

MAPS = {name: GridMap.from_regions(notation) for name, notation in SCENARIOS.items()}
RIGHT, LEFT = 0, 4


def always(*actions: int) -> list[list[float]]:
    """A policy that takes one action in each state."""
    return [[float(index == action) for index in range(8)] for action in actions]


def test_a_corridor_by_hand() -> None:
    grid = GridMap.from_text("AB·")
    identity = IdentityState(grid.symbols)
    assert expected_steps(grid, identity, always(RIGHT, RIGHT)) == ExpectedSteps(1.5, 1.0, 1.5, 1.0)
    # Cut off after one step, the left one of the two cells has not arrived.
    assert expected_steps(grid, identity, always(RIGHT, RIGHT), step_limit=1) == ExpectedSteps(1.5, 1.0, 1.0, 0.5)
    # To and fro for ever.
    assert expected_steps(grid, identity, always(RIGHT, LEFT), step_limit=9) == ExpectedSteps(inf, 0.0, 9.0, 0.0)


def test_chance_by_hand() -> None:
    grid = GridMap.from_text("A·")
    half = [[0.5, 0.0, 0.0, 0.0, 0.5, 0.0, 0.0, 0.0]]
    result = expected_steps(grid, IdentityState(grid.symbols), half, step_limit=2)
    assert (result.steps, result.reaches) == (pytest.approx(2.0), 1.0)
    assert (result.limited_steps, result.reaches_in_time) == (1.5, 0.75)


def test_where_only_some_end_the_rest_is_not_hidden() -> None:
    # B goes either way; on the left A holds for ever.
    grid = GridMap.from_text("AB·")
    either = [[0.0] * 4 + [1.0] + [0.0] * 3, [0.25, 0, 0, 0, 0.75, 0, 0, 0]]
    result = expected_steps(grid, IdentityState(grid.symbols), either, step_limit=10)
    assert result.steps == inf
    assert result.reaches == pytest.approx(0.125)
    assert result.reaches_in_time == pytest.approx(0.125)
    assert result.limited_steps == pytest.approx(0.5 * 10 + 0.5 * (0.25 + 0.75 * 10))


@pytest.mark.parametrize("away", [1e-20, 1e-13])
def test_what_ends_only_in_theory_counts_as_endless(away: float) -> None:
    grid = GridMap.from_text("A·")
    stuck = [[away, 0.0, 0.0, 0.0, 1.0 - away, 0.0, 0.0, 0.0]]
    result = expected_steps(grid, IdentityState(grid.symbols), stuck)
    assert (result.steps, result.reaches) == (inf, 1.0)
    assert result.limited_steps == pytest.approx(100.0)


@pytest.mark.parametrize("name", sorted(MAPS))
def test_the_random_walk_of_every_scenario_is_the_same(name: str) -> None:
    # The labels are of no concern to it; 48.3 steps and 82 % were measured on a prototype.
    grid = MAPS[name]
    result = expected_steps(grid, IdentityState(grid.symbols), uniform(len(grid.symbols)))
    assert result.steps == pytest.approx(59.2185, abs=5e-5)
    assert result.limited_steps == pytest.approx(48.2656, abs=5e-5)
    assert result.reaches_in_time == pytest.approx(0.81675, abs=5e-6)


def test_what_is_simulated_agrees() -> None:
    grid = MAPS["2"]
    identifier = LastSymbols(grid.symbols, 2)
    parameters = QParameters(alpha=0.3, gamma=1.0, temperature=TemperatureSchedule(1.0, 0.99, 0.2))
    learner = QLearning(identifier.states, grid_actions(), parameters)
    for trial in range(400):
        run_trial(grid, identifier, learner, 0, trial)
    greedily = replace(parameters, temperature=TemperatureSchedule(1.0, 0.99, 0.0))
    frozen = QLearning(identifier.states, grid_actions(), greedily, frozen=True)
    frozen.set_state(learner.get_state())
    walks = [run_trial(grid, identifier, frozen, 1, trial) for trial in range(2000)]
    exact = expected_steps(grid, identifier, greedy(learner.q))
    error = 4.0 * np.std([walk.steps for walk in walks]) / np.sqrt(2000)
    assert np.mean([walk.steps for walk in walks]) == pytest.approx(exact.limited_steps, abs=error)
    assert np.mean([walk.reached for walk in walks]) == pytest.approx(exact.reaches_in_time, abs=0.04)


def test_greedy_shares_what_is_equally_good() -> None:
    assert greedy([[-1.0, 0.0, 0.0, -3.0]]) == ((0.0, 0.5, 0.5, 0.0),)


@given(
    st.sampled_from(sorted(MAPS)),
    st.integers(1, 3),
    st.integers(0, 2**32 - 1),
    st.sampled_from([0.0, 0.05, 1.0, 30.0]),
)
def test_no_policy_over_past_symbols_is_below_the_belief_state_optimum(
    name: str, length: int, seed: int, sharpness: float
) -> None:
    grid = MAPS[name]
    identifier = LastSymbols(grid.symbols, length)
    rng = np.random.default_rng(seed)
    weights = np.exp(sharpness * rng.normal(size=(len(identifier.states), 8)))
    result = expected_steps(grid, identifier, (weights / weights.sum(axis=1, keepdims=True)).tolist())
    optimum = float(belief_optimum(grid))
    assert result.steps >= optimum - 1e-9
    assert result.limited_steps >= optimum - 1e-9
    assert result.steps >= result.limited_steps - 1e-9


@pytest.mark.parametrize(
    ("policy", "says"),
    [
        (always(RIGHT), "1 rows' is refused: 2, one a state"),
        ([[1.0], [1.0]], "8 probabilities that sum to 1"),
        ([[0.5] * 8, [0.125] * 8], "8 probabilities"),
        ([[1.5, -0.5, 0, 0, 0, 0, 0, 0], [0.125] * 8], "8 probabilities"),
    ],
)
def test_a_policy_that_does_not_fit_is_refused(policy: list[list[float]], says: str) -> None:
    grid = GridMap.from_text("AB·")
    with pytest.raises(ConfigurationError, match=says):
        expected_steps(grid, IdentityState(grid.symbols), policy)


def test_an_identifier_of_other_symbols_is_refused() -> None:
    with pytest.raises(ConfigurationError, match="the symbols of the map, A, B"):
        expected_steps(GridMap.from_text("AB·"), IdentityState(("B", "A")), uniform(2))


def test_an_automaton_that_is_often_lost_has_finitely_many_places() -> None:
    grid = GridMap.from_text("AB·")
    machine = Machine(Kind.MOORE, ("A", "B"), ((0, None),), ("only",))
    identifier = replace(AutomatonState.of(machine), anchors=(None, None))
    result = expected_steps(grid, identifier, uniform(len(identifier.states)))
    assert result.steps == pytest.approx(expected_steps(grid, IdentityState(grid.symbols), uniform(2)).steps)


def test_a_memory_without_bounds_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    grid = MAPS["1"]
    identifier = LastSymbols(grid.symbols, 3)
    monkeypatch.setattr(chain, "MOST_PLACES", 100)
    with pytest.raises(ConfigurationError, match="at most 100 places"):
        expected_steps(grid, identifier, uniform(len(identifier.states)))
