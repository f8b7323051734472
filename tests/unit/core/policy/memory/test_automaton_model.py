"""Automata as models: networks that hold a belief, states counted, the way back to the right one."""

import numpy as np
import pytest

from palpate.core.automata.letters import letters_of
from palpate.core.errors import ConfigurationError
from palpate.core.perception import IdentityState
from palpate.core.policy import MemoryLearner, MemoryParameters
from palpate.core.policy.memory import AutomatonModel, StateBelief, automaton_model
from palpate.core.policy.memory.automaton_model import fit_automata, network_of
from palpate.core.policy.memory.clone_model import CloneModel
from palpate.simulation.grid import GridMap, belief_optimum, grid_actions, walked_steps
from tests.unit.core.policy.memory.worlds import random_trials, small_automaton


def test_a_network_holds_the_belief_of_the_world_that_it_is_made_of() -> None:
    world = CloneModel.blank((0, 0, 1, 1, 2, 2), 3, 2, np.random.default_rng(0))
    network = network_of(world, letters_of("ABC", "xy"), "xy")
    belief, hidden = StateBelief(world.pomdp(), 1), network.advance(network.start_state[None], 1)
    for action, symbol in ((0, 2), (1, 2), (1, 0), (0, 1)):
        expected = world.pomdp().moved(belief.probabilities, action)
        foretold = [expected[[2 * each, 2 * each + 1]].sum() for each in range(3)]
        read = network.read(hidden)[0].reshape(2, 4)[action]
        assert read == pytest.approx([*foretold, world.goal[action] @ belief.probabilities], abs=1e-5)
        belief.update(action, symbol)
        hidden = network.advance(hidden, (1 + action) * 3 + symbol)
    # Units of a network take turns over the symbols.
    assert hidden[0] == pytest.approx(belief.probabilities[[0, 2, 4, 1, 3, 5]], abs=1e-4)


def ring(size: int) -> AutomatonModel:
    """Places in a ring, of which the first one reads B and the others A; the goal is next to it."""
    symbol_of = np.array([1, *[0] * (size - 1)])
    after = (np.arange(size) + 1) % size
    targets = np.full((size, 1, 2), -1)
    targets[np.arange(size), 0, symbol_of[after]] = after
    shares = np.where(targets[:, :, [0, 1, 1]] >= 0, 1.0, 0.0)
    shares[:, :, 2], shares[0, 0] = 0.0, (0.5, 0.0, 0.5)
    return AutomatonModel(symbol_of, np.eye(size)[1], targets, shares, np.full((1, size), 1.0 / size))


def test_a_belief_in_the_wrong_state_comes_back_to_the_right_one() -> None:
    model = ring(6)
    belief = StateBelief(model, 0)
    assert belief.probabilities[1] == 1.0
    # It is two places further than the start says: the B comes early, then all goes as it should.
    for symbol in (0, 0, 1, 0, 0):
        belief.update(0, symbol)
    assert belief.probabilities.argmax() == 2
    assert belief.probabilities[2] > 0.7


def test_what_follows_sums_to_one_and_where_nothing_is_known_it_leads_anywhere() -> None:
    model = ring(6)
    assert model.moved(np.eye(6)[2], 0).sum() == pytest.approx(1.0)
    assert model.moved(np.eye(6)[0], 0).sum() == pytest.approx(0.5)
    strange = AutomatonModel(model.symbol_of, model.start, np.full((6, 1, 2), -1), model.shares, model.jumps)
    assert strange.moved(np.eye(6)[2], 0) == pytest.approx(np.full(6, 1.0 / 6.0))


def test_a_plan_costs_the_discounted_steps_to_the_goal() -> None:
    table = ring(3).plan().table[:, 0]
    # From the first place half of the tries arrive, the others go once round.
    first = (1.0 + 0.5 * 0.98 * (1.0 + 0.98)) / (1.0 - 0.5 * 0.98**3)
    assert table == pytest.approx([first, 1.0 + 0.98 * (1.0 + 0.98 * first), 1.0 + 0.98 * first], rel=1e-4)


def test_the_loss_is_that_of_what_was_read() -> None:
    corridor = random_trials(GridMap.from_text("ABC·"), 5)
    starts = [0.4 if trial.symbols[0] == 0 else 0.3 for trial in corridor]
    moved = [
        0.9 * (0.9 / 3.0 + 0.1 * (0.4 if symbol == 0 else 0.3)) for trial in corridor for symbol in trial.symbols[1:]
    ]
    arrived = [0.1] * sum(trial.reached for trial in corridor)
    told = -np.log([*starts, *moved, *arrived])
    assert small_automaton().log_loss(corridor) == pytest.approx(told.mean(), abs=1e-6)


def test_places_that_read_alike_are_told_apart_and_the_plan_is_near_the_optimum(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(automaton_model, "_UNITS", 12)
    monkeypatch.setattr(automaton_model, "_GUESSES", 2)
    corridor = GridMap.from_text("AABA·")
    trials = random_trials(corridor, 120)
    models = fit_automata(trials, 2, 8)
    learner = MemoryLearner(corridor.symbols, grid_actions(), MemoryParameters(kind="automaton"), frozen=True)
    learner.use(models, trials)
    found, optimum = walked_steps(corridor, IdentityState(corridor.symbols), learner), float(belief_optimum(corridor))
    assert found.reaches == 1.0
    assert optimum - 1e-9 <= found.steps <= 1.3 * optimum
    again = fit_automata(trials, 2, 8)
    assert [model.shares.tobytes() for model in models] == [model.shares.tobytes() for model in again]


@pytest.mark.parametrize("count", [1, 65])
def test_alphabets_of_one_symbol_or_too_many_are_refused(count: int) -> None:
    names = [f"s{number}" for number in range(count)]
    with pytest.raises(ConfigurationError, match="from 2 to 64, for an automaton"):
        MemoryLearner(names, grid_actions(), MemoryParameters(kind="automaton"))
