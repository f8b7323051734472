"""Strings, prefix trees, Elman networks and their training."""

import json
from itertools import product

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.core.automata import PrefixTree
from palpate.core.automata.elman import Architecture, Network, Readout, network_text
from palpate.core.automata.restarts import Restarts, TrainingTask, levels_of
from palpate.core.automata.strings import Strings
from palpate.core.automata.training import TrainingSettings, train
from palpate.core.errors import ConfigurationError
from tests.unit.core.automata.networks import hidden_states

texts = st.lists(st.lists(st.sampled_from("ABC"), min_size=1, max_size=6).map("".join), min_size=2, max_size=40)


class TestStrings:
    @pytest.mark.parametrize(
        ("texts", "labels", "alphabet", "said"),
        [
            ([], [], "AB", r"strings must be at least one string"),
            (["AB", ""], [], None, r"strings\[1\].*at least one symbol"),
            (["AB", "AXB"], [], "AB", r"strings\[1\] must be symbols of the alphabet A B"),
            (["AAA", "A"], [], "AB", "strings must be strings in which two different symbols occur"),
            (
                ["AB", "BA", "AB"],
                [True, True, False],
                None,
                "strings must be strings that are labelled alike",
            ),
            (["AB", "BA"], [True], None, "true or false for each of 2"),
            (["AB"], [], "ABA", "different names"),
        ],
    )
    def test_what_cannot_be_learned_from_is_refused_in_one_line(self, texts, labels, alphabet, said):
        with pytest.raises(ConfigurationError, match=said) as caught:
            Strings.of(texts, labels, alphabet=alphabet)
        assert "\n" not in str(caught.value)

    @given(texts, st.floats(0.01, 0.99), st.integers(0, 1000))
    def test_split_loses_nothing_and_is_repeatable(self, listed, share, seed):
        strings = Strings(("A", "B", "C"), tuple((0, 1, *map("ABC".index, word)) for word in listed))
        kept, held = strings.split(share, seed)
        assert sorted(kept.words + held.words) == sorted(strings.words)
        assert (kept, held) == strings.split(share, seed)
        assert kept.alphabet == held.alphabet == strings.alphabet
        assert abs(len(held.words) - share * len(strings.words)) <= 1.0


def prefixes(tree):
    found = []
    for parent, symbol in zip(tree.parents, tree.symbols, strict=True):
        found.append(() if parent < 0 else (*found[parent], int(symbol)))
    return found


words = st.lists(st.lists(st.integers(0, 2), min_size=1, max_size=7).map(tuple), max_size=30)


class TestPrefixTree:
    @given(words)
    def test_tree_holds_each_prefix_once_and_counts_its_strings(self, listed):
        strings = Strings(("a", "b", "c"), ((0, 1), *listed))
        tree = PrefixTree.of(strings)
        held = prefixes(tree)
        assert sorted(held) == sorted({word[:n] for word in strings.words for n in range(len(word) + 1)})
        assert [held[node] for node in tree.nodes] == list(strings.words)
        for prefix, passes, counts in zip(held, tree.passes, tree.counts, strict=True):
            through = [word for word in strings.words if word[: len(prefix)] == prefix]
            assert passes == len(through)
            assert counts[-1] == through.count(prefix)
        assert tree.counts.sum() == strings.symbols + len(strings.words)

    @given(words, st.integers(0, 3))
    def test_automaton_runs_over_all_prefixes_at_once(self, listed, start):
        tree = PrefixTree.of(Strings(("a", "b", "c"), ((0, 1), *listed)))
        transitions = np.random.default_rng(len(listed)).integers(4, size=(4, 3))
        for prefix, state in zip(prefixes(tree), tree.states(transitions, start), strict=True):
            expected = start
            for symbol in prefix:
                expected = transitions[expected, symbol]
            assert state == expected


def network(seed=0, *, alphabet=("a", "b", "c"), reading=Readout.PREDICTION, **shape):
    architecture = Architecture(alphabet=alphabet, reading=reading, **shape)
    rng = np.random.default_rng(seed)
    return Network(architecture, **{name: rng.normal(size=size) for name, size in architecture.shapes.items()})


class TestElman:
    def test_predictions_are_probabilities_even_of_huge_weights(self):
        one = network(2)
        huge = Network(one.architecture, one.recurrent, one.inputs, one.start, 1e6 * one.output, one.bias)
        shares = huge.read(np.array([[0.0, 1.0], [1.0, 0.3]]))
        assert shares.shape == (2, 4)
        assert shares.sum(axis=1) == pytest.approx(1.0)
        assert np.isfinite(shares).all()

    @pytest.mark.parametrize("reading", list(Readout))
    @pytest.mark.parametrize("order", [1, 2])
    def test_file_has_the_shape_and_every_weight_to_the_last_bit(self, reading, order):
        one = network(4, alphabet=("x- y0", "b"), reading=reading, hidden=3, activation="tanh", order=order)
        data = json.loads(network_text(one))
        shape = {"schema": "palpate.elman/1", "alphabet": ["x- y0", "b"], "reading": reading.value, "hidden": 3}
        shape |= {"activation": "tanh", "order": order}
        assert {key: data.pop(key) for key in shape} == shape
        for name, values in data.items():
            assert np.array(values).tobytes() == getattr(one, name).tobytes()
        assert set(data) == set(one.architecture.shapes)


POSITIVE = Strings.of(["abca", "cab", "abca", "b", "cc"])
LABELLED = Strings.of(["abca", "cab", "abca", "b", ""], [True, False, True, False, True])
SHAPES = [
    Architecture(alphabet=("a", "b", "c"), reading=reading, hidden=3, activation=activation, order=order)
    for reading, activation, order in product(Readout, ("sigmoid", "tanh"), (1, 2))
]
shapes = pytest.mark.parametrize("shape", SHAPES, ids=lambda s: f"{s.reading.value}-{s.activation}-{s.order}")


def loss_string_by_string(network, strings):
    """The definition, without a tree: nats per symbol (with the end), or a string; and whether all is right."""
    total, drawn, right = 0.0, 0, True
    for place, word in enumerate(strings.words):
        hidden = network.start_state[np.newaxis]
        for symbol in word:
            if not strings.labelled:
                total -= np.log(network.read(hidden)[0, symbol])
            hidden = network.after(hidden, np.full(len(hidden), symbol))
        drawn += 1 if strings.labelled else len(word) + 1
        said = network.read(hidden)[0]
        if not strings.labelled:
            total -= np.log(said[-1])
            continue
        label = strings.labels[place]
        total -= np.log(said[0] if label else 1.0 - said[0])
        right = right and (said[0] > 0.5) == label
    return float(total / drawn), bool(right)


class TestRestarts:
    @shapes
    def test_batch_does_what_its_networks_do_one_by_one(self, shape):
        strings = LABELLED if shape.reading is Readout.ACCEPTANCE else POSITIVE
        tree = PrefixTree.of(strings)
        task, restarts = TrainingTask(tree, shape), Restarts(shape, 5, seed=3)
        hidden = restarts.hidden_states(levels_of(tree))
        losses, right = task.losses(restarts, hidden)
        for place in range(5):
            network = restarts.network(place)
            assert hidden[place].detach().numpy().T == pytest.approx(hidden_states(network, tree), abs=1e-5)
            loss, all_right = loss_string_by_string(network, strings)
            assert losses[place].item() == pytest.approx(loss, rel=1e-4)
            assert right is None or bool(right[place]) is all_right

    def test_network_depends_on_the_seed_and_its_number_alone(self):
        many, few = Restarts(SHAPES[0], 6, seed=5), Restarts(SHAPES[0], 2, seed=5, skip=3)
        for name in SHAPES[0].shapes:
            assert getattr(few.network(1), name).tobytes() == getattr(many.network(4), name).tobytes()
            assert getattr(many.network(3), name).tobytes() != getattr(many.network(4), name).tobytes()

    def test_gradients_are_clipped_network_by_network(self):
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


BINARY = ("0", "1")
EVEN_ONES = Strings.of(
    [f"{n:0{length}b}" if length else "" for length in range(6) for n in range(2**length)],
    [n.bit_count() % 2 == 0 for length in range(6) for n in range(2**length)],
)
ACCEPTOR = Architecture(alphabet=BINARY, reading=Readout.ACCEPTANCE, order=2)
PREDICTOR = Architecture(alphabet=("a", "b"), reading=Readout.PREDICTION)
RANDOM_WALKS = Strings.of(["ab", "abab", "ab", "aab"])


def parameters(training):
    return [getattr(t.network, name).tobytes() for t in training.networks for name in t.network.architecture.shapes]


class TestTraining:
    def test_equal_seeds_give_equal_bytes_and_others_do_not(self):
        settings = TrainingSettings(restarts=6, batch=4, steps=30, look_every=7)
        one, again = train(RANDOM_WALKS, PREDICTOR, settings), train(RANDOM_WALKS, PREDICTOR, settings)
        assert parameters(one) == parameters(again)
        assert one.curve == again.curve
        other = train(RANDOM_WALKS, PREDICTOR, TrainingSettings(restarts=6, batch=4, steps=30, look_every=7, seed=1))
        assert parameters(one) != parameters(other)

    def test_best_is_kept_even_if_none_is_consistent(self):
        # A step size that throws every network about: what was best is far from what is last.
        wild = TrainingSettings(restarts=4, batch=4, steps=40, learning_rate=30.0, look_every=1)
        training = train(EVEN_ONES, ACCEPTOR, wild)
        assert training.consistent == 0
        assert training.best.loss == min(point.best_loss for point in training.curve)
        assert training.curve[-1].best_loss > training.best.loss
        assert "none is correct about every training string" in training.summary

    def test_training_lowers_the_loss_to_that_of_the_source(self):
        # After an a comes a b with 3 in 4, an a otherwise; after a b the end.
        training = train(Strings.of(["ab"] * 3 + ["aab"]), PREDICTOR, TrainingSettings(restarts=8, batch=8, steps=300))
        choices = 3 * np.log(4 / 3) + np.log(4.0)
        assert training.best.loss == pytest.approx(choices / 13, abs=0.01)
