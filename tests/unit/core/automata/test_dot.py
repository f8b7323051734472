import warnings
from dataclasses import replace

from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.core.automata.dot import to_dot_text
from palpate.core.automata.machine import Kind, Machine
from tests.unit.core.automata.machines import dfa, machines

with warnings.catch_warnings():
    # pydot calls its parser library by names of old.
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

names = st.text(min_size=1, max_size=4) | st.sampled_from(
    ["\\N", "&lt;", 'a"', "a\\", "\n", "true", "s0", "x / y", "\\n"]
)


def test_a_dfa_as_dot():
    assert to_dot_text(PARITY) == TEXT


def test_a_moore_machine_shows_its_outputs_below_the_names():
    machine = Machine(Kind.MOORE, ("a",), ((1,), (0,)), ("x", ("p", "q")))
    text = to_dot_text(machine)
    assert '  q0 [shape=circle, label="s0\\nx"];' in text
    assert '  q1 [shape=circle, label="s1\\n{p, q}"];' in text


def test_a_mealy_machine_shows_symbol_and_output():
    machine = Machine(Kind.MEALY, ("a", "b", "c"), ((0, 0, 0),), edge_outputs=(("x", "y", "x"),))
    assert '  q0 -> q0 [label="a, c / x\\nb / y"];' in to_dot_text(machine)


def test_marks_are_escaped():
    machine = dfa([[0]], [], alphabet=("&",), labels=('\\N"',))
    text = to_dot_text(machine)
    assert r'  q0 [shape=circle, label="\"\\\\N\\\"\""];' in text
    assert '  alphabet="&amp;";' in text


@settings(max_examples=30)
@given(machines(), names)
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
