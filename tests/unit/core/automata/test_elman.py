import json

import numpy as np
import pytest

from palpate.core.automata import PrefixTree, Strings
from palpate.core.automata.elman import END, Architecture, Network, Readout, network_text, network_to_dict
from palpate.core.errors import ConfigurationError


def network(seed=0, *, alphabet=("a", "b", "c"), reading=Readout.PREDICTION, **shape) -> Network:
    architecture = Architecture(alphabet=alphabet, reading=reading, **shape)
    rng = np.random.default_rng(seed)
    return Network(architecture, **{name: rng.normal(size=size) for name, size in architecture.shapes.items()})


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("activation", ["sigmoid", "tanh"])
def test_all_ways_to_advance_agree(order, activation) -> None:
    one = network(1, order=order, activation=activation, hidden=3)
    strings = Strings(("a", "b", "c"), ((0, 1, 2, 2), (2, 1, 0), (2, 2), (0,)))
    tree = PrefixTree.of(strings)
    hidden = one.hidden_states(tree)
    for word, node in zip(strings.words, tree.nodes, strict=True):
        state = one.start_state
        for symbol in word:
            weights = one.recurrent[symbol if order == 2 else 0]
            drive = weights @ state + one.inputs[symbol]
            state = np.tanh(drive) if activation == "tanh" else 1.0 / (1.0 + np.exp(-drive))
        assert hidden[node] == pytest.approx(state)
    for symbol in range(3):
        assert one.after(hidden, np.full(len(hidden), symbol)) == pytest.approx(one.advance(hidden, symbol))


def test_predictions_are_probabilities_even_of_huge_weights() -> None:
    one = network(2)
    huge = Network(one.architecture, one.recurrent, one.inputs, one.start, 1e6 * one.output, one.bias)
    shares = huge.read(np.array([[0.0, 1.0], [1.0, 0.3]]))
    assert shares.shape == (2, 4)
    assert shares.sum(axis=1) == pytest.approx(1.0)
    assert np.isfinite(shares).all()


def test_the_end_of_a_string_is_no_symbol() -> None:
    with pytest.raises(ConfigurationError, match="means the end of a string"):
        Architecture(alphabet=("a", END), reading=Readout.PREDICTION)


def test_bad_parameters_are_refused() -> None:
    one = network()
    for bad in (np.zeros((2, 2)), np.full((3, 2), np.nan)):
        with pytest.raises(ConfigurationError, match=r"network\.inputs.*shape \(3, 2\)"):
            Network(one.architecture, one.recurrent, bad, one.start, one.output, one.bias)


def test_another_alphabet_is_refused_also_in_another_order() -> None:
    one = network()
    one.require_alphabet(("a", "b", "c"))
    with pytest.raises(ConfigurationError, match="the network's own: a, b, c"):
        one.require_alphabet(("b", "a", "c"))
    with pytest.raises(ConfigurationError, match=r"network\.alphabet"):
        one.hidden_states(PrefixTree.of(Strings.of(["ab"])))


@pytest.mark.parametrize("reading", list(Readout))
@pytest.mark.parametrize("order", [1, 2])
def test_the_file_has_the_shape_and_every_weight_to_the_last_bit(reading, order) -> None:
    one = network(4, alphabet=("x- y0", "b"), reading=reading, hidden=3, activation="tanh", order=order)
    data = json.loads(network_text(one))
    assert data == network_to_dict(one)
    shape = {"schema": "palpate.elman/1", "alphabet": ["x- y0", "b"], "reading": reading.value, "hidden": 3}
    shape |= {"activation": "tanh", "order": order}
    assert {key: data.pop(key) for key in shape} == shape
    for name, values in data.items():
        assert np.array(values).tobytes() == getattr(one, name).tobytes()
    assert set(data) == set(one.architecture.shapes)
