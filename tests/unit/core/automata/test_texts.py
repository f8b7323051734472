import warnings
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.core.automata.machine import Kind, Machine
from palpate.core.automata.texts import Edge, edges, shown_name, shown_names, shown_output, to_dot_text
from tests.unit.core.automata.machines import dfa, machines

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


@pytest.mark.parametrize("name", ["A", "in the middle", "+x-y", "a|b", "ä", "true"])
def test_most_names_stand_as_they_are(name):
    assert shown_name(name) == name


@pytest.mark.parametrize(("name", "shown"), QUOTED)
def test_what_might_be_misread_is_in_quotes(name, shown):
    assert shown_name(name) == shown


def test_symbols_that_lead_the_same_way_share_an_edge():
    machine = dfa([[0, 1, 0], [None, 1, 1]], [1], alphabet="abc")
    assert edges(machine) == (Edge(0, 0, "a, c"), Edge(0, 1, "b"), Edge(1, 1, "b, c"))


with warnings.catch_warnings():
    # pydot calls its parser library by dot_names of old.
    warnings.filterwarnings("ignore", category=DeprecationWarning, module=r"pydot\.")
    from pydot.dot_parser import parse_dot_data

PARITY = dfa([[1, 0], [0, None]], [0], labels=("even", "odd"))
TEXT = """\
digraph automaton {
  kind="dfa";
  alphabet="a, b";
  rankdir=LR;
  start [shape=point, label=""];
  q0 [shape=doublecircle, label="even"];
  q1 [shape=circle, label="odd"];
  start -> q0;
  q0 -> q1 [label="a"];
  q0 -> q0 [label="b"];
  q1 -> q0 [label="a"];
}
"""

dot_names = st.text(min_size=1, max_size=4) | st.sampled_from(
    ["\\N", "&lt;", 'a"', "a\\", "\n", "true", "s0", "x / y", "\\n"]
)


def test_a_dfa_as_dot():
    assert to_dot_text(PARITY) == TEXT


def test_a_moore_machine_shows_its_outputs_below_the_names():
    machine = Machine(Kind.MOORE, ("a",), ((1,), (0,)), ("x", ("p", "q")))
    text = to_dot_text(machine)
    assert '  q0 [shape=circle, label="s0\\nx"];' in text
    assert '  q1 [shape=circle, label="s1\\n{p, q}"];' in text


def test_marks_are_escaped():
    machine = dfa([[0]], [], alphabet=("&",), labels=('\\N"',))
    text = to_dot_text(machine)
    assert r'  q0 [shape=circle, label="\"\\\\N\\\"\""];' in text
    assert '  alphabet="&amp;";' in text


@settings(max_examples=10)
@given(machines(), dot_names)
def test_another_reader_of_dot_finds_states_and_edges(machine, name):
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
