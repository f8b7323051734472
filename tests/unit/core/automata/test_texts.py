import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.core.automata.machine import Kind, Machine
from palpate.core.automata.texts import Edge, edges, shown_name, shown_names, shown_output
from tests.unit.core.automata.machines import dfa

names = st.text(min_size=1, max_size=5) | st.sampled_from(
    ["true", "a, b", "a / b", '"', "\\", "\n", "{}", " a", "\ud800"]
)
outputs = (
    st.booleans() | st.text(max_size=3) | st.sampled_from(["true", "false"]) | st.lists(names, max_size=3).map(tuple)
)


@given(st.lists(names, min_size=1, max_size=4).map(tuple), st.lists(names, min_size=1, max_size=4).map(tuple))
def test_different_names_read_differently(some, others):
    assert shown_names(some).isprintable()
    assert (shown_names(some) == shown_names(others)) == (some == others)


@given(outputs, outputs)
def test_different_outputs_read_differently(one, other):
    assert (shown_output(one) == shown_output(other)) == (one == other and type(one) is type(other))


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
