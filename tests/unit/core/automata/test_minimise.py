from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.core.automata.machine import Kind, Machine
from palpate.core.automata.minimise import difference, equivalent_states, minimised
from palpate.core.errors import ConfigurationError
from tests.unit.core.automata.machines import KINDS, canonical, classes_by_table, dfa, machines, words

# Ends in "ab", with three copies of the state after "a" and one that no word leads to.
ENDS_IN_AB = dfa([[1, 0], [2, 3], [4, 3], [1, 0], [1, 3], [5, 5]], [3], labels=("none", "a1", "a2", "ab", "a3", "x"))


@given(machines(), st.data())
def test_classes_are_those_of_the_filled_table(machine, data):
    count = len(machine.transitions)
    apart = data.draw(st.none() | st.lists(st.sampled_from("pq"), min_size=count, max_size=count))
    assert set(map(frozenset, equivalent_states(machine, apart))) == classes_by_table(machine, apart)


@given(machines(), st.data())
def test_the_minimal_machine_answers_every_word_alike(machine, data):
    count = len(machine.transitions)
    apart = data.draw(st.none() | st.lists(st.integers(0, 1), min_size=count, max_size=count))
    small = minimised(machine, apart)
    for word in words(len(machine.alphabet), 5):
        assert small.output_of(word) == machine.output_of(word)


@given(machines())
def test_a_minimal_machine_cannot_be_made_smaller(machine):
    small = minimised(machine)
    assert minimised(small) == small
    assert small.reachable() == tuple(range(len(small.transitions)))
    assert len(classes_by_table(small)) == len(small.transitions)
    assert small.complete or not machine.complete


def test_numbers_go_breadth_first_in_the_order_of_the_symbols():
    machine = dfa([[3, 1], [2, 2], [2, 2], [0, 2]], [2], labels="pqrs")
    assert canonical(machine).labels == ("p", "s", "q", "r")
    assert canonical(machine).transitions == ((1, 2), (0, 3), (3, 3), (3, 3))


def test_merged_states_carry_the_names_of_all():
    small = minimised(ENDS_IN_AB)
    assert small == dfa([[1, 0], [1, 2], [1, 0]], [2], labels=("none", "a1|a2|a3", "ab"))
    assert equivalent_states(ENDS_IN_AB) == ((0,), (1, 2, 4), (3,))


def test_many_names_are_counted():
    chain = dfa([[1, 0], [2, 0], [3, 0], [0, 0]], [0, 1, 2, 3], labels=("first", "b", "c", "d"))
    assert minimised(chain).labels == ("first|3 more",)


def test_labels_stay_different_even_where_one_looks_like_two():
    machine = dfa([[1, 2], [3, 3], [3, 3], [0, 0]], [3], labels=("p|q", "p", "q", "r"))
    assert minimised(machine).labels == ("p|q", "p|q (2)", "r")


def test_labels_say_nothing_about_what_a_machine_does():
    assert replace(minimised(ENDS_IN_AB), labels=()) == minimised(replace(ENDS_IN_AB, labels=()))


def test_each_state_needs_a_class():
    with pytest.raises(ConfigurationError, match="6 classes"):
        minimised(ENDS_IN_AB, apart=["p"])


def test_a_large_machine_is_soon_done():
    count = 20_000
    ring = dfa([[(state + 1) % count] for state in range(count)], range(0, count, 4), alphabet="a")
    assert minimised(ring).transitions == ((1,), (2,), (3,), (0,))
    assert len(minimised(replace(ring, state_outputs=(True, *[False] * (count - 1)))).transitions) == count


ALL = dfa([[0, 0]], [0])

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


def test_a_difference_reads_as_a_sentence():
    found = difference(dfa([[0, 1], [None, 1]], [0]), dfa([[0, 1], [0, 1]], [0]))
    assert str(found) == "the word b a: not known against true"
    assert found.word == (1, 0)


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
