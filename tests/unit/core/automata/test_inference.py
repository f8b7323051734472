"""From a trained network to an automaton: partition, choice, and the whole inference."""

from collections import deque
from dataclasses import replace
from math import floor

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.core.automata import Kind, Machine, PrefixTree, Strings, bounded_partition, difference
from palpate.core.automata.choice import (
    ExtractionSettings,
    accepting_extract,
    model_loss,
    predicting_extracts,
    price_of,
)
from palpate.core.automata.elman import END, RANGES, Architecture, Network, Readout
from palpate.core.automata.infer import InferenceSettings, _acceptor, infer
from palpate.core.automata.training import TrainedNetwork, TrainingSettings
from palpate.core.errors import ConfigurationError
from tests.unit.core.automata.networks import LARGE, drift, last_symbol, parity


def one_by_one(network, intervals):
    """The algorithm as it is written down, cell by cell."""
    low, high = RANGES[network.architecture.activation]

    def cell_of(state):
        return tuple(min(floor((value - low) / ((high - low) / intervals)), intervals - 1) for value in state)

    start = network.start_state.tolist()
    numbers, vectors, rows = {cell_of(start): 0}, [start], []
    queue = deque(vectors)
    while queue:
        state = queue.popleft()
        row = []
        for symbol in range(len(network.architecture.alphabet)):
            after = network.after(np.array([state]), np.array([symbol]))[0].tolist()
            if cell_of(after) not in numbers:
                numbers[cell_of(after)] = len(numbers)
                vectors.append(after)
                queue.append(vectors[-1])
            row.append(numbers[cell_of(after)])
        rows.append(row)
    return vectors, rows


architectures = st.builds(
    Architecture,
    alphabet=st.sampled_from([("a", "b"), ("a", "b", "c", "d")]),
    reading=st.sampled_from(Readout),
    hidden=st.integers(1, 3),
    activation=st.sampled_from(["sigmoid", "tanh"]),
    order=st.integers(1, 2),
)


def drawn(shape, seed):
    rng = np.random.default_rng(seed)
    return Network(shape, **{name: 2.0 * rng.normal(size=size) for name, size in shape.shapes.items()})


def entered_by(machine):
    found = [set() for _ in machine.transitions]
    for row in machine.transitions:
        for symbol, target in enumerate(row):
            found[target].add(symbol)
    return found


class TestPartition:
    @given(architectures, st.integers(0, 10**6), st.integers(1, 9))
    def test_level_at_once_is_one_after_the_other(self, shape, seed, intervals):
        network = drawn(shape, seed)
        found = bounded_partition(network, intervals)
        vectors, rows = one_by_one(network, intervals)
        assert found.transitions.tolist() == rows
        assert found.vectors == pytest.approx(np.array(vectors), abs=1e-12)

    @given(architectures, st.integers(0, 10**6), st.integers(2, 9))
    def test_one_symbol_at_most_leads_into_each_state_also_where_several_lead_into_its_cell(
        self, shape, seed, intervals
    ):
        machine = bounded_partition(drawn(shape, seed), intervals, by_symbol=True).minimal()
        assert all(len(symbols) <= 1 for symbols in entered_by(machine))

    @given(architectures, st.integers(0, 10**6), st.integers(2, 9))
    def test_with_strings_every_state_is_one_that_a_string_comes_to(self, shape, seed, intervals):
        tree = PrefixTree.of(Strings.of(["ab", "bba", "abb"], alphabet=shape.alphabet))
        found = bounded_partition(drawn(shape, seed), intervals, 100, tree=tree)
        assert set(tree.states(found.transitions).tolist()) == set(range(len(found.vectors)))
        assert sorted(found.machine().reachable()) == list(range(len(found.vectors)))

    def test_threshold_decides_what_is_possible(self):
        shares = bounded_partition(last_symbol(), 2)
        assert shares.machine(0.4).state_outputs[0] == ("a", "b")
        assert shares.machine(0.6).state_outputs[0] == ()
        assert shares.machine(0.6).state_outputs[1] == ("b",)


AB = PrefixTree.of(Strings.of(["ab", "ab", "abab", "b"]))
AB_LABELLED = PrefixTree.of(Strings.of(["a", "b"], [True, False]))
HELD = PrefixTree.of(Strings.of(["ab", "abab"]))


def three_steps():
    """Accepts when a came three times or more since the last b: too fine for few intervals."""
    one = drift()
    shape = Architecture(alphabet=("a", "b"), reading=Readout.ACCEPTANCE, hidden=1, activation="tanh", order=2)
    return Network(shape, one.recurrent, one.inputs, one.start, [[20.0]], [-6.0])


class TestChoice:
    def test_smallest_consistent_q_is_taken(self):
        words = ["", "a", "aa", "aaa", "aaaa", "aab", "aaba", "aaab"]
        tree = PrefixTree.of(Strings.of(words, [word.endswith("aaa") for word in words]))
        found = accepting_extract(three_steps(), tree, ExtractionSettings())
        assert (found.intervals, found.raw_states, found.states, found.wrong) == (4, 4, 4, 0.0)
        for intervals in (2, 3):
            only = ExtractionSettings(fewest_intervals=intervals, most_intervals=intervals)
            assert accepting_extract(three_steps(), tree, only).wrong == 0.25

    def test_loss_is_that_of_counted_probabilities(self):
        one_state = Machine(Kind.MOORE, ("a", "b"), ((0, 0),), (("a",),))
        # Training: a 4, b 5, end 4 times; half a count more of each for the symbol, and for the state as that has them.
        symbol = np.array([4.5, 5.5, 4.5]) / 14.5
        shares = (np.array([4, 5, 4]) + 1.5 * symbol) / 14.5
        # Held out: a 3, b 3, end 2.
        assert model_loss(one_state, AB, HELD) == pytest.approx(-(np.array([3, 3, 2]) @ np.log(shares)) / 8)
        assert price_of(one_state, AB) == pytest.approx(2 / 13)

    def test_q_of_too_many_states_is_left_out(self):
        # One tanh unit: three intervals give one state, four give four.
        long = PrefixTree.of(Strings.of(["aaab", "ab"]))
        found = predicting_extracts(
            drift(), long, ExtractionSettings(most_intervals=6, most_states=3, merge_symbols=True), HELD
        )
        assert [(extract.intervals, extract.raw_states) for extract in found] == [(2, 1), (3, 1)]
        with pytest.raises(ConfigurationError, match=r"extraction\.most_states must be larger"):
            accepting_extract(three_steps(), AB_LABELLED, ExtractionSettings(fewest_intervals=4, most_states=2))


BINARY = [f"{n:0{length}b}" if length else "" for length in range(7) for n in range(2**length)]
ODD_ZEROS = Strings.of(BINARY, [word.count("0") % 2 == 1 for word in BINARY])


# Walks between three places in a row, a b c, that end right of c. Whoever comes to b from a goes on to c.
RANDOM_WALKS = Strings.of(["abc", "bc", "abcbc", "c", "bcbcbc", "cbc", "abcbcbc", "bcbc", "cbcbc"] * 40)
PREDICTION = InferenceSettings(training=TrainingSettings(restarts=8, steps=800), finalists=2)


class TestInference:
    def test_language_is_inferred_from_labelled_strings_and_held_out_ones_judge_it(self):
        message = []
        training = TrainingSettings(restarts=32, steps=400, enough=4)
        found = infer(ODD_ZEROS, InferenceSettings(order=2, held_out=0.25, training=training), progress=message.append)
        assert difference(found.machine, Machine(Kind.DFA, ("0", "1"), ((1, 0), (0, 1)), (False, True))) is None
        assert found.consistent is True
        assert (found.chosen.states, found.strings, found.held_out) == (2, 95, 32)
        assert found.chosen.raw_states >= 2
        assert tuple(message) == found.training.curve
        assert (
            f"q = {found.chosen.intervals}, {found.chosen.raw_states} cells, 2 states after minimisation"
            in found.summary
        )
        assert found.chosen.agreement == 1.0
        assert "agreement: 100.0% of the held-out strings (32 strings)" in found.summary

    def test_of_automata_that_are_right_and_equally_small_the_tightest_is_taken(self):
        even, words = parity(), ["", "0", "1", "00", "000", "01"]
        # Once a 1 came, all is rejected: only words with two of them would tell the two languages apart.
        never = replace(even, recurrent=[[[LARGE]], [[0.0]]])
        tree = PrefixTree.of(Strings.of(words, ["1" not in word for word in words]))
        found = [TrainedNetwork(network, k, 0.0, consistent=True) for k, network in enumerate((even, even, never))]
        chosen, (extract,) = _acceptor(found, tree, None, ExtractionSettings())
        assert chosen.network is never
        assert (extract.wrong, extract.states) == (0.0, 2)

    def test_walks_give_a_machine_that_says_what_may_come_next(self):
        walks = infer(RANDOM_WALKS, PREDICTION)
        machine = walks.machine
        assert machine.kind is Kind.MOORE
        assert walks.consistent is None
        word = [machine.alphabet.index(name) for name in "abc"]
        assert machine.output_of(word[:1]) == ("b",)
        assert machine.output_of(word[:2]) == ("c",)
        assert machine.output_of(word) == ("b", END)
        assert (walks.strings, walks.held_out) == (288, 72)
