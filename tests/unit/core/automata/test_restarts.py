from itertools import product

import numpy as np
import pytest

from palpate.core.automata import Architecture, Network, PrefixTree, Readout, Strings
from palpate.core.automata.restarts import Restarts, TrainingTask, levels_of

POSITIVE = Strings.of(["abca", "cab", "abca", "b", "cc"])
LABELLED = Strings.of(["abca", "cab", "abca", "b", ""], [True, False, True, False, True])
SHAPES = [
    Architecture(alphabet=("a", "b", "c"), reading=reading, hidden=3, activation=activation, order=order)
    for reading, activation, order in product(Readout, ("sigmoid", "tanh"), (1, 2))
]
shapes = pytest.mark.parametrize("shape", SHAPES, ids=lambda s: f"{s.reading.value}-{s.activation}-{s.order}")


def loss_string_by_string(network: Network, strings: Strings) -> tuple[float, bool]:
    """The definition, without a tree: nats a symbol (with the end), or a string; and whether all is right."""
    total, drawn, right = 0.0, 0, True
    for place, word in enumerate(strings.words):
        hidden = network.start_state[np.newaxis]
        for symbol in word:
            if not strings.labelled:
                total -= np.log(network.read(hidden)[0, symbol])
            hidden = network.advance(hidden, symbol)
        drawn += 1 if strings.labelled else len(word) + 1
        said = network.read(hidden)[0]
        if not strings.labelled:
            total -= np.log(said[-1])
            continue
        label = strings.labels[place]
        total -= np.log(said[0] if label else 1.0 - said[0])
        right = right and (said[0] > 0.5) == label
    return float(total / drawn), bool(right)


@shapes
def test_a_batch_does_what_its_networks_do_one_by_one(shape) -> None:
    strings = LABELLED if shape.reading is Readout.ACCEPTANCE else POSITIVE
    tree = PrefixTree.of(strings)
    task, restarts = TrainingTask(tree, shape), Restarts(shape, 5, seed=3)
    hidden = restarts.hidden_states(levels_of(tree))
    losses, right = task.losses(restarts, hidden)
    for place in range(5):
        network = restarts.network(place)
        assert hidden[place].detach().numpy().T == pytest.approx(network.hidden_states(tree), abs=1e-5)
        loss, all_right = loss_string_by_string(network, strings)
        assert losses[place].item() == pytest.approx(loss, rel=1e-4)
        assert right is None or bool(right[place]) is all_right


def test_a_network_depends_on_the_seed_and_its_number_alone() -> None:
    many, few = Restarts(SHAPES[0], 6, seed=5), Restarts(SHAPES[0], 2, seed=5, skip=3)
    for name in SHAPES[0].shapes:
        assert getattr(few.network(1), name).tobytes() == getattr(many.network(4), name).tobytes()
        assert getattr(many.network(3), name).tobytes() != getattr(many.network(4), name).tobytes()


def test_gradients_are_clipped_network_by_network() -> None:
    import torch

    restarts = Restarts(SHAPES[0], 3, seed=0)
    for parameter in restarts.parameters.values():
        parameter.grad = torch.zeros_like(parameter)
    bias = restarts.parameters["bias"].grad
    bias[0, 0], bias[0, 1], bias[1, 0], bias[2, 0] = 30.0, 40.0, 0.5, torch.nan
    restarts.parameters["start"].grad[2] = 7.0
    restarts.clip(1.0)
    assert bias[0, :2].tolist() == pytest.approx([0.6, 0.8])
    assert bias[1, 0].item() == 0.5
    assert bias[2].tolist() == [0.0] * 4
    assert torch.isfinite(restarts.parameters["start"].grad).all()


def test_noise_comes_from_its_generator() -> None:
    import torch

    levels, restarts = levels_of(PrefixTree.of(POSITIVE)), Restarts(SHAPES[0], 2, seed=0)
    drawn = [
        restarts.hidden_states(levels, noise=0.5, generator=torch.Generator().manual_seed(seed)) for seed in (1, 1, 2)
    ]
    assert torch.equal(drawn[0], drawn[1])
    assert not torch.equal(drawn[0], drawn[2])
