from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.core.automata.machine import Kind, Machine
from palpate.core.automata.minimise import AutomatonDifference, difference, minimised
from palpate.core.errors import ConfigurationError
from tests.unit.core.automata.machines import KINDS, dfa, machines, words

ALL = dfa([[0, 0]], [0])
ALL_BUT_EMPTY = dfa([[1, 1], [1, 1]], [1])

pairs = st.sampled_from(KINDS).flatmap(lambda kind: st.tuples(machines(kind, 2), machines(kind, 2)))


@given(pairs)
def test_the_first_of_the_shortest_words_is_found(pair):
    one, other = pair
    found = difference(one, other)
    # Every difference has a word shorter than the states of both together.
    differing = (word for word in words(2, 6) if one.output_of(word) != other.output_of(word))
    first = next(differing, None)
    if found is None or len(found.word) > 6:
        assert first is None
    else:
        assert found.word == first
    if found is not None:
        assert found.symbols == tuple("ab"[symbol] for symbol in found.word)
        assert found.outputs == (one.output_of(found.word), other.output_of(found.word))
        assert found.outputs[0] != found.outputs[1]


@given(pairs)
def test_equal_answers_are_equal_minimal_machines(pair):
    one, other = pair
    assert (difference(one, other) is None) == (minimised(one) == minimised(other))


@given(machines())
def test_a_machine_does_what_its_minimal_one_does(machine):
    assert difference(machine, minimised(machine)) is None
    assert difference(machine, machine) is None


def test_machines_that_differ_on_the_empty_word_only():
    found = difference(ALL, ALL_BUT_EMPTY)
    assert found == AutomatonDifference((), (), (True, False))
    assert found
    assert str(found) == "the empty word: true against false"
    assert difference(ALL, ALL_BUT_EMPTY) is not None


def test_a_difference_reads_as_a_sentence():
    found = difference(dfa([[0, 1], [None, 1]], [0]), dfa([[0, 1], [0, 1]], [0]))
    assert str(found) == "the word b a: not known against true"
    assert found.word == (1, 0)


def test_what_is_not_known_is_unlike_every_completion():
    partial = dfa([[0, None]], [0])
    assert difference(partial, partial.completed(False)) == AutomatonDifference((1,), ("b",), (None, False))
    assert difference(partial, replace(partial, labels=("p",))) is None
    assert difference(partial.completed(False), dfa([[0, 1], [1, 1]], [0])) is None


def test_mealy_machines_differ_with_the_first_symbol_at_the_earliest():
    one = Machine(Kind.MEALY, ("a", "b"), ((0, 0),), edge_outputs=(("x", "y"),))
    other = Machine(Kind.MEALY, ("a", "b"), ((0, 0),), edge_outputs=(("x", "x"),))
    assert difference(one, other) == AutomatonDifference((1,), ("b",), ("y", "x"))
    stays_silent = Machine(Kind.MEALY, ("a", "b"), ((None, None),), edge_outputs=((None, None),))
    assert str(difference(one, stays_silent)) == "the word a: x against not known"


def test_a_truth_value_is_not_its_name():
    one, other = (Machine(Kind.MOORE, ("a",), ((0,),), (output,)) for output in (True, "true"))
    assert str(difference(one, other)) == 'the empty word: true against "true"'


@pytest.mark.parametrize("alphabet", ["abc", "ba", "ax"])
def test_another_alphabet_is_refused_naming_both(alphabet):
    other = dfa([[0] * len(alphabet)], [0], alphabet=alphabet)
    with pytest.raises(ConfigurationError) as refused:
        difference(ALL, other)
    assert refused.value.field == "automaton.alphabet"
    assert str(tuple(alphabet)) in str(refused.value)
    assert "('a', 'b')" in str(refused.value)


def test_another_kind_is_refused():
    moore = Machine(Kind.MOORE, ("a", "b"), ((0, 0),), (True,))
    with pytest.raises(ConfigurationError, match="'moore' is refused: dfa"):
        difference(ALL, moore)
