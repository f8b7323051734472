import numpy as np
import pytest

from palpate.core.automata import Kind, Machine, PrefixTree, Strings
from palpate.core.automata.choice import (
    ExtractionSettings,
    accepting_extract,
    cheapest,
    labelled,
    last_symbols,
    looseness,
    model_loss,
    predicting_extracts,
    price_of,
)
from palpate.core.automata.elman import END, Architecture, Network, Readout
from palpate.core.errors import ConfigurationError
from tests.unit.core.automata.networks import drift, last_symbol, parity

WORDS = ["", "1", "11", "101", "0", "0100"]
EVEN = PrefixTree.of(Strings.of(WORDS, [word.count("1") % 2 == 0 for word in WORDS]))
AB = PrefixTree.of(Strings.of(["ab", "ab", "abab", "b"]))
AB_LABELLED = PrefixTree.of(Strings.of(["a", "b"], [True, False]))
HELD = PrefixTree.of(Strings.of(["ab", "abab"]))


def three_steps() -> Network:
    """Accepts when a came three times or more since the last b: too fine for few intervals."""
    one = drift()
    shape = Architecture(alphabet=("a", "b"), reading=Readout.ACCEPTANCE, hidden=1, activation="tanh", order=2)
    return Network(shape, one.recurrent, one.inputs, one.start, [[20.0]], [-6.0])


def test_the_smallest_consistent_q_is_taken() -> None:
    words = ["", "a", "aa", "aaa", "aaaa", "aab", "aaba", "aaab"]
    tree = PrefixTree.of(Strings.of(words, [word.endswith("aaa") for word in words]))
    found = accepting_extract(three_steps(), tree, ExtractionSettings())
    assert (found.intervals, found.raw_states, found.states, found.wrong) == (4, 4, 4, 0.0)
    for intervals in (2, 3):
        only = ExtractionSettings(fewest_intervals=intervals, most_intervals=intervals)
        assert accepting_extract(three_steps(), tree, only).wrong == 0.25


def test_without_a_consistent_q_the_best_is_kept() -> None:
    words = ["a", "b", "ab", "aa"]
    tree = PrefixTree.of(Strings.of(words, [True, False, False, True]))
    found = accepting_extract(three_steps(), tree, ExtractionSettings(most_intervals=9))
    assert found.wrong == 0.5
    assert found.intervals == 2
    assert found.cost == 0.5


def test_an_acceptor_that_lets_little_through_and_is_right_is_tighter() -> None:
    tree = PrefixTree.of(Strings.of(["aa", "aa", "ab"], [True, True, False]))
    only_a = Machine(Kind.DFA, ("a", "b"), ((0, 1), (1, 1)), (True, False))
    even_b = Machine(Kind.DFA, ("a", "b"), ((0, 1), (1, 0)), (True, False))
    assert looseness(only_a, tree) == pytest.approx(2.0 * np.log(0.25) + np.log(0.75))
    assert looseness(even_b, tree) == pytest.approx(3.0 * np.log(0.5))


def test_acceptance_needs_labels() -> None:
    with pytest.raises(ConfigurationError, match="labelled strings"):
        accepting_extract(parity(), PrefixTree.of(Strings.of(["01"])), ExtractionSettings())


def test_another_alphabet_is_refused() -> None:
    with pytest.raises(ConfigurationError, match=r"network\.alphabet"):
        accepting_extract(parity(), AB, ExtractionSettings())
    with pytest.raises(ConfigurationError, match=r"network\.alphabet"):
        predicting_extracts(last_symbol(), AB, ExtractionSettings(), EVEN)


def test_all_q_are_judged_for_prediction_and_the_smallest_of_equals_is_taken() -> None:
    found = predicting_extracts(last_symbol(), AB, ExtractionSettings(most_intervals=6), HELD)
    assert [extract.intervals for extract in found] == [2, 3, 4, 5, 6]
    assert {extract.states for extract in found} == {3}
    chosen = cheapest(found)
    assert chosen is found[0]
    assert chosen.cost == chosen.loss + chosen.price


def test_the_loss_is_that_of_counted_probabilities() -> None:
    one_state = Machine(Kind.MOORE, ("a", "b"), ((0, 0),), (("a",),))
    # Training: a 4, b 5, end 4 times; half a count added to each for the symbol, and for the state as that has them.
    symbol = np.array([4.5, 5.5, 4.5]) / 14.5
    shares = (np.array([4, 5, 4]) + 1.5 * symbol) / 14.5
    # Held out: a 3, b 3, end 2.
    assert model_loss(one_state, AB, HELD) == pytest.approx(-(np.array([3, 3, 2]) @ np.log(shares)) / 8)
    assert price_of(one_state, AB) == pytest.approx(2 / 13)


def test_where_an_incomplete_automaton_is_lost_it_goes_on_as_its_follower_does() -> None:
    # After b there is no way on: all else is being lost, in one state of its own.
    lost = Machine(Kind.MOORE, ("a", "b"), ((0, None),), (("a",),))
    assert 0.0 < model_loss(lost, AB, HELD) < 2.0
    assert model_loss(last_symbols(AB, 1), AB, HELD) < model_loss(lost, AB, HELD)


def test_states_are_named_by_their_last_symbol_and_what_follows() -> None:
    assert last_symbols(AB, 1).transitions == ((1, 2), (None, 2), (1, None))
    assert labelled(last_symbols(AB, 1), AB).labels == ("start > a b", "a > b", f"b > {END} a")


def test_a_q_of_too_many_states_is_left_out() -> None:
    # One tanh unit: three intervals give one state, four give four.
    long = PrefixTree.of(Strings.of(["aaab", "ab"]))
    found = predicting_extracts(
        drift(), long, ExtractionSettings(most_intervals=6, most_states=3, merge_symbols=True), HELD
    )
    assert [(extract.intervals, extract.raw_states) for extract in found] == [(2, 1), (3, 1)]
    with pytest.raises(ConfigurationError, match=r"extraction\.most_states = 2 is refused: more"):
        accepting_extract(three_steps(), AB_LABELLED, ExtractionSettings(fewest_intervals=4, most_states=2))


def test_the_highest_q_is_not_below_the_lowest() -> None:
    with pytest.raises(ConfigurationError, match=r"extraction\.most_intervals = 4 is refused: a whole number from 5"):
        ExtractionSettings(fewest_intervals=5, most_intervals=4)
