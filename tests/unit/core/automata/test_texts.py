import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.core.automata.machine import Kind, Machine
from palpate.core.automata.texts import (
    Edge,
    edge_line_in,
    edges,
    names_in,
    output_in,
    shown_name,
    shown_names,
    shown_output,
)
from palpate.core.errors import ConfigurationError
from tests.unit.core.automata.machines import dfa

names = st.text(min_size=1, max_size=5) | st.sampled_from(
    ["true", "a, b", "a / b", '"', "\\", "\n", "{}", " a", "\ud800"]
)
outputs = (
    st.booleans() | st.text(max_size=3) | st.sampled_from(["true", "false"]) | st.lists(names, max_size=3).map(tuple)
)


@given(st.lists(names, min_size=1, max_size=4).map(tuple))
def test_names_read_back(given_names):
    text = shown_names(given_names)
    assert text.isprintable()
    assert names_in(text) == given_names


@given(outputs)
def test_outputs_read_back_with_their_types(output):
    read = output_in(shown_output(output))
    assert read == output
    assert type(read) is type(output)


QUOTED = [(" a", '" a"'), ("", '""'), ('a"b', r'"a\"b"'), ("a\nb", r'"a\nb"'), ("a\\b", r'"a\\b"'), ("a,b", '"a,b"')]
SETS = [((), "{}"), (("A", "B"), "{A, B}"), (("true",), "{true}"), (("A, B",), '{"A, B"}'), ("{A}", '"{A}"')]


@pytest.mark.parametrize("name", ["A", "in the middle", "+x-y", "a|b", "ä", "true"])
def test_most_names_stand_as_they_are(name):
    assert shown_name(name) == name


@pytest.mark.parametrize(("name", "shown"), QUOTED)
def test_what_might_be_misread_is_in_quotes(name, shown):
    assert shown_name(name) == shown


@pytest.mark.parametrize(("output", "shown"), [(True, "true"), ("true", '"true"'), ("A", "A"), *SETS])
def test_outputs_show_their_sort(output, shown):
    assert shown_output(output) == shown


def test_symbols_that_lead_the_same_way_share_an_edge():
    machine = dfa([[0, 1, 0], [None, 1, 1]], [1], alphabet="abc")
    assert edges(machine) == (Edge(0, 0, ("a, c",)), Edge(0, 1, ("b",)), Edge(1, 1, ("b, c",)))


def test_in_a_mealy_machine_each_output_has_a_line():
    said = (("x", "y", "x"),)
    machine = Machine(Kind.MEALY, ("a", "b", "c"), ((0, 0, 0),), edge_outputs=said)
    assert edges(machine) == (Edge(0, 0, ("a, c / x", "b / y")),)
    assert edge_line_in("a, c / x", Kind.MEALY) == (("a", "c"), "x")
    assert edge_line_in("a, c", Kind.DFA) == (("a", "c"), None)


@pytest.mark.parametrize("text", ["", ",", "a,", "a,,b", '"a', 'a "b"', '"\\q"', "a / b", "{a}", "a\\"])
def test_what_is_no_list_of_names_is_refused(text):
    with pytest.raises(ConfigurationError) as refused:
        names_in(text)
    assert len(str(refused.value).splitlines()) == 1


@pytest.mark.parametrize("text", ["", "a, b", "{a", "{a,}", "/"])
def test_what_is_no_output_is_refused(text):
    with pytest.raises(ConfigurationError):
        output_in(text)


@pytest.mark.parametrize("text", ["a", "a /", "/ x", "a / b / c"])
def test_an_edge_of_a_mealy_machine_has_symbols_and_an_output(text):
    with pytest.raises(ConfigurationError):
        edge_line_in(text, Kind.MEALY)
