from itertools import pairwise

import numpy as np
import pytest

from palpate.core.automata import AutomatonState, InferenceSettings, Strings, TrainingSettings, infer
from palpate.core.automata.choice import ExtractionSettings, model_loss
from palpate.core.automata.elman import NORMALISED, Architecture, Network, Readout
from palpate.core.automata.normalised import NormalisedRestarts
from palpate.core.automata.partition import bounded_partition
from palpate.core.automata.prefix_tree import PrefixTree
from palpate.core.automata.restarts import TrainingTask
from palpate.core.errors import ConfigurationError

PLACES = (0, 0, 1, 0, 1, 1)
"""Symbols of places in a row; right of the last one is the goal."""
LEFT, RIGHT = 0, 1


def walks(count: int, seed: int = 0) -> Strings:
    rng, told = np.random.default_rng(seed), []
    for _ in range(count):
        place, done = int(rng.integers(len(PLACES))), []
        symbols = [PLACES[place]]
        while place < len(PLACES) and len(done) < 12:
            done.append(int(rng.integers(2)))
            place = place + 1 if done[-1] == RIGHT else max(0, place - 1)
            symbols += [PLACES[place]] if place < len(PLACES) else []
        told.append((symbols, done))
    return Strings.of_walks(("A", "B"), ("left", "right"), told)


def shape_of(strings: Strings, units: int = 6) -> Architecture:
    return Architecture(
        alphabet=strings.alphabet, reading=Readout.PREDICTION, hidden=units, activation=NORMALISED, order=2,
        actions=strings.actions,
    )  # fmt: skip


def along(network: Network, word: tuple[int, ...]) -> list[np.ndarray]:
    """Hidden states of the network after each letter, by the definition."""
    symbol_of, found = np.arange(network.architecture.hidden) % 2, []
    hidden = network.start
    for letter in word:
        fed_back = network.recurrent[letter // 2] @ hidden + 1e-6
        fed_back[symbol_of != letter % 2] = 0.0
        hidden = fed_back / fed_back.sum()
        found.append(hidden)
    return found


def test_a_batch_does_what_its_networks_do_one_by_one() -> None:
    strings = walks(9)
    tree, shape = PrefixTree.of(strings), shape_of(strings)
    task, restarts = TrainingTask(tree, shape), NormalisedRestarts(shape, 3, seed=4)
    hidden = restarts.hidden_states(task.levels)
    losses, _ = task.losses(restarts, hidden)
    for number in range(3):
        network = restarts.network(number)
        assert hidden[number].detach().numpy().T == pytest.approx(network.hidden_states(tree), abs=1e-5)
        total, counted = 0.0, 0
        for word, end in zip(strings.words, strings.ends, strict=True):
            states = along(network, word)
            assert network.hidden_states(tree)[tree.nodes[strings.words.index(word)]] == pytest.approx(states[-1])
            outcomes = [(letter // 2 - 1) * 3 + letter % 2 for _, letter in pairwise(word)]
            outcomes += [] if end is None else [end * 3 + 2]
            total -= sum(np.log(network.read(h[None])[0, o]) for h, o in zip(states, outcomes, strict=False))
            counted += len(outcomes)
        assert losses[number].item() == pytest.approx(total / counted, rel=1e-3)


def test_noise_disturbs_and_the_price_is_that_of_extreme_shares() -> None:
    strings = walks(5)
    task = TrainingTask(PrefixTree.of(strings), shape_of(strings))
    mild, extreme = (NormalisedRestarts(shape_of(strings), 1, seed=1, scale=scale) for scale in (0.1, 5.0))
    assert 0.0 < mild.price(100).item() < extreme.price(100).item()
    noisy, plain = (mild.hidden_states(task.levels, noise=noise).detach().numpy() for noise in (0.5, 0.0))
    assert np.abs(noisy - plain).max() > 0.01


@pytest.fixture(scope="module")
def found():
    training = TrainingSettings(restarts=4, batch=4, steps=60, learning_rate=0.6, clip=100.0)
    extraction = ExtractionSettings(fewest_intervals=2, most_intervals=4)
    return infer(
        walks(120),
        InferenceSettings(activation=NORMALISED, hidden=12, finalists=1, training=training, extraction=extraction),
    )


def test_it_learns_places_that_the_last_letters_do_not_tell(found) -> None:
    """After the first steps the place is certain, and so is all that follows."""
    assert found.chosen.loss < 0.6 * min(found.beside.values())


def test_possible_letters_are_followed_beyond_the_strings(found) -> None:
    network = found.network.network
    few = PrefixTree.of(walks(3))
    cells = bounded_partition(network, 3, by_symbol=True, tree=few)
    assert len(cells.vectors) > len(set(few.states(cells.transitions).tolist()))
    shares = network.read(cells.vectors).reshape(len(cells.vectors), 2, 3)[:, :, :2]
    assert (cells.transitions[:, 2:].reshape(-1, 2, 2)[shares > 0.02] >= 0).all()
    visited = len(set(few.states(cells.transitions).tolist()))
    bounded = bounded_partition(network, 3, visited, by_symbol=True, tree=few)
    assert len(bounded.vectors) == visited
    assert bounded_partition(network, 3, visited - 1, by_symbol=True, tree=few) is None


def test_a_minimised_automaton_foretells_what_its_network_does(found) -> None:
    machine, cells = found.machine, found.chosen.partition
    predicted = cells.predicted(machine)
    assert predicted.shape == (len(machine.transitions), 6)
    assert predicted.reshape(-1, 3).sum(axis=1) == pytest.approx(1.0, abs=1e-5)
    tree = PrefixTree.of(walks(60, seed=1))
    told = model_loss(machine, tree, tree, predicted)
    assert told < model_loss(machine, tree, tree, np.full_like(predicted, 1 / 3))
    assert AutomatonState.of(machine).states[-1] == "lost"


@pytest.mark.parametrize("other", [{"order": 1}, {"hidden": 5}, {"actions": (), "alphabet": ("A", "B")}])
def test_a_normalised_layer_is_for_actions_second_order_and_equal_shares(other) -> None:
    fields = {"alphabet": walks(5).alphabet, "actions": ("left", "right"), "order": 2, "hidden": 6} | other
    with pytest.raises(ConfigurationError, match=r"network\.activation.*as many units for each symbol"):
        Architecture(reading=Readout.PREDICTION, activation=NORMALISED, **fields)
