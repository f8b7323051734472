"""Machines: what they answer, minimal ones, files, and texts for people."""

import json
import warnings
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.core.automata import document, to_json_text
from palpate.core.automata.document import from_json_text, to_dot_text
from palpate.core.automata.machine import Kind, Machine, shown_names, shown_output
from palpate.core.automata.minimise import difference, equivalent_states, minimised
from palpate.core.errors import ConfigurationError
from tests.unit.core.automata.machines import KINDS, classes_by_table, dfa, machines, words

PARITY = dfa([[1, 0], [0, 1]], [0])
TWO_OUTPUTS = Machine(Kind.MOORE, ("a",), ((1,), (0,)), ("x", ("y", "z")))


class TestMachine:
    def test_word_leads_to_a_state_and_an_output(self):
        assert [PARITY.output_of(word) for word in [(), (0,), (0, 1), (0, 0)]] == [True, False, False, True]
        assert TWO_OUTPUTS.output_of((0,)) == ("y", "z")

    @pytest.mark.parametrize(
        ("machine", "changes"),
        [
            (PARITY, {"alphabet": ()}),
            (PARITY, {"labels": ("p",)}),
            (PARITY, {"transitions": (), "state_outputs": ()}),
            (PARITY, {"transitions": ((0, 0), (0,))}),
            (PARITY, {"transitions": ((0, 0), (0, 2))}),
            (PARITY, {"start": 2}),
            (PARITY, {"state_outputs": (True,)}),
        ],
    )
    def test_parts_that_do_not_fit_are_refused(self, machine, changes):
        with pytest.raises(ConfigurationError, match="that fit"):
            replace(machine, **changes)


# Ends in "ab", with three copies of the state after "a" and one that no word leads to.
ENDS_IN_AB = dfa([[1, 0], [2, 3], [4, 3], [1, 0], [1, 3], [5, 5]], [3], labels=("none", "a1", "a2", "ab", "a3", "x"))
ALL = dfa([[0, 0]], [0])
pairs = st.sampled_from(KINDS).flatmap(lambda kind: st.tuples(machines(kind, 2), machines(kind, 2)))


class TestMinimal:
    @given(machines(), st.data())
    def test_classes_are_those_of_the_filled_table(self, machine, data):
        count = len(machine.transitions)
        apart = data.draw(st.none() | st.lists(st.sampled_from("pq"), min_size=count, max_size=count))
        assert set(map(frozenset, equivalent_states(machine, apart))) == classes_by_table(machine, apart)

    @given(machines(), st.data())
    def test_minimal_machine_answers_every_word_alike(self, machine, data):
        count = len(machine.transitions)
        apart = data.draw(st.none() | st.lists(st.integers(0, 1), min_size=count, max_size=count))
        small = minimised(machine, apart)
        for word in words(len(machine.alphabet), 5):
            assert small.output_of(word) == machine.output_of(word)

    @given(machines())
    def test_minimal_machine_cannot_be_made_smaller(self, machine):
        small = minimised(machine)
        assert minimised(small) == small
        assert small.reachable() == tuple(range(len(small.transitions)))
        assert len(classes_by_table(small)) == len(small.transitions)
        assert small.complete or not machine.complete

    def test_merged_states_carry_the_names_of_all(self):
        small = minimised(ENDS_IN_AB)
        assert small == dfa([[1, 0], [1, 2], [1, 0]], [2], labels=("none", "a1|a2|a3", "ab"))
        assert equivalent_states(ENDS_IN_AB) == ((0,), (1, 2, 4), (3,))

    @given(pairs)
    def test_first_of_the_shortest_words_is_found(self, pair):
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

    @pytest.mark.parametrize("alphabet", ["abc", "ba"])
    def test_another_alphabet_is_refused_naming_both(self, alphabet):
        other = dfa([[0] * len(alphabet)], [0], alphabet=alphabet)
        with pytest.raises(ConfigurationError) as refused:
            difference(ALL, other)
        assert refused.value.field == "automaton.alphabet"
        assert str(list(alphabet)) in str(refused.value)
        moore = Machine(Kind.MOORE, ("a", "b"), ((0, 0),), (True,))
        with pytest.raises(ConfigurationError, match="must be dfa"):
            difference(ALL, moore)


NAMED = dfa([[1, 0], [0, None]], [0], labels=("even", "odd"))
MOORE = Machine(Kind.MOORE, ("a",), ((0,),), (("x", "y"),))
FILE = """\
{
 "schema": "palpate.automaton/2",
 "kind": "dfa",
 "alphabet": ["a", "b"],
 "start": "even",
 "states": [
  {"name": "even", "output": true, "next": {"a": "odd", "b": "even"}},
  {"name": "odd", "output": false, "next": {"a": "even", "b": null}}
 ]
}
"""


class TestFile:
    def test_file_looks_as_documented(self):
        assert to_json_text(NAMED) == FILE
        assert "".join(f"    {line}\n" for line in FILE.splitlines()) in document.__doc__
        assert json.loads(to_json_text(MOORE))["states"] == [{"name": "s0", "output": ["x", "y"], "next": {"a": "s0"}}]

    @given(machines(), st.booleans(), st.data())
    def test_machine_reads_back_and_gives_the_same_bytes(self, machine, named, data):
        names = st.text(min_size=1) | st.sampled_from(["\ud800", "s0", "null"])
        if named:
            count = len(machine.transitions)
            machine = replace(
                machine, labels=tuple(data.draw(st.lists(names, min_size=count, max_size=count, unique=True)))
            )
        count = len(machine.alphabet)
        machine = replace(
            machine, alphabet=tuple(data.draw(st.lists(names, min_size=count, max_size=count, unique=True)))
        )
        text = to_json_text(machine)
        assert text.isascii()
        assert from_json_text(text) == machine
        assert to_json_text(from_json_text(text)) == text

    @given(st.data())
    def test_damaged_file_is_either_refused_or_a_machine(self, data):
        at = data.draw(st.integers(0, len(FILE) - 1))
        damaged = FILE[:at] + data.draw(st.sampled_from(["", '"', "{", "null", "\n", "a"])) + FILE[at + 1 :]
        try:
            read = from_json_text(damaged)
        except ConfigurationError:
            return
        assert from_json_text(to_json_text(read)) == read


shown = st.text(min_size=1, max_size=5) | st.sampled_from(
    ["true", "a, b", "a / b", '"', "\\", "\n", "{}", " a", "\ud800"]
)
shown_outputs = (
    st.booleans() | st.text(max_size=3) | st.sampled_from(["true", "false"]) | st.lists(shown, max_size=3).map(tuple)
)
with warnings.catch_warnings():
    # pydot calls its parser library by dot_names of old.
    warnings.filterwarnings("ignore", category=DeprecationWarning, module=r"pydot\.")
    from pydot.dot_parser import parse_dot_data


dot_names = st.text(min_size=1, max_size=4) | st.sampled_from(
    ["\\N", "&lt;", 'a"', "a\\", "\n", "true", "s0", "x / y", "\\n"]
)


class TestTexts:
    @given(st.lists(shown, min_size=1, max_size=4).map(tuple), st.lists(shown, min_size=1, max_size=4).map(tuple))
    def test_different_names_read_differently(self, some, others):
        assert shown_names(some).isprintable()
        assert (shown_names(some) == shown_names(others)) == (some == others)

    @given(shown_outputs, shown_outputs)
    def test_different_outputs_read_differently(self, one, other):
        assert (shown_output(one) == shown_output(other)) == (one == other and type(one) is type(other))

    @settings(max_examples=10)
    @given(machines(), dot_names)
    def test_another_reader_of_dot_finds_states_and_edges(self, machine, name):
        machine = replace(machine, alphabet=(name, *(f"{name}{number}" for number in range(1, len(machine.alphabet)))))
        text = to_dot_text(machine)
        assert to_dot_text(machine) == text
        (graph,) = parse_dot_data(text)
        assert len(graph.get_nodes()) == len(machine.transitions) + 1
        routes = {
            (source, target) for source, row in enumerate(machine.transitions) for target in row if target is not None
        }
        found = {(edge.get_source(), edge.get_destination()) for edge in graph.get_edges()}
        assert found == {("start", f"q{machine.start}"), *((f"q{source}", f"q{target}") for source, target in routes)}
