import warnings
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.core.automata.dot import from_dot_text, to_dot_text
from palpate.core.automata.machine import Kind, Machine
from palpate.core.errors import ConfigurationError
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
    assert from_dot_text(text) == machine


@given(machines(), st.data())
def test_a_machine_reads_back_and_gives_the_same_bytes(machine, data):
    count = len(machine.alphabet)
    machine = replace(machine, alphabet=tuple(data.draw(st.lists(names, min_size=count, max_size=count, unique=True))))
    if data.draw(st.booleans()):
        count = len(machine.transitions)
        machine = replace(
            machine, labels=tuple(data.draw(st.lists(names, min_size=count, max_size=count, unique=True)))
        )
    text = to_dot_text(machine)
    assert from_dot_text(text) == machine
    assert to_dot_text(from_dot_text(text)) == text


@given(st.booleans() | names | st.lists(names, max_size=2).map(tuple), names)
def test_any_output_reads_back(output, name):
    moore = Machine(Kind.MOORE, (name,), ((0,), (0,)), (output, "x"))
    mealy = Machine(Kind.MEALY, ("a", "b", "c"), ((0, 0, None),), edge_outputs=((output, "x", None),))
    assert from_dot_text(to_dot_text(moore)) == moore
    assert from_dot_text(to_dot_text(mealy)) == mealy


@settings(max_examples=30)
@given(machines(), names)
def test_another_reader_of_dot_finds_states_and_edges(machine, name):
    machine = replace(machine, alphabet=(name, *(f"{name}{number}" for number in range(1, len(machine.alphabet)))))
    (graph,) = parse_dot_data(to_dot_text(machine))
    assert len(graph.get_nodes()) == len(machine.transitions) + 1
    routes = {
        (source, target) for source, row in enumerate(machine.transitions) for target in row if target is not None
    }
    found = {(edge.get_source(), edge.get_destination()) for edge in graph.get_edges()}
    assert found == {("start", f"q{machine.start}"), *((f"q{source}", f"q{target}") for source, target in routes)}


def test_line_ends_of_another_system_are_no_matter():
    assert from_dot_text(TEXT.replace("\n", "\r\n")) == PARITY


@pytest.mark.parametrize(
    ("old", "new", "line"),
    [
        ("digraph automaton", "digraph g", 1),
        ("  kind", "  comment", 2),
        ('"dfa"', '"nfa"', 2),
        ('"a, b"', '"a, a"', None),
        ('"a, b"', '"a,"', 3),
        ('"a, b"', '"b"', 9),
        ('"a, b"', '"b, a"', 9),
        ("  rankdir=LR;\n", "", 4),
        ('circle, label="odd', 'box, label="odd', None),
        ('label="odd"', 'label="even"', None),
        ('label="odd"', 'label="odd, even"', 7),
        ('label="odd"', 'label="odd", color=red', None),
        ("  q1 [", "  q2 [", None),
        ("  start -> q0;\n", "", None),
        ("start -> q0", "start -> q2", 8),
        ("q0 -> q1", "q0 -> q7", 9),
        ("q0 -> q1", "q0 -> q99999999999999999999", 9),
        ('q0 [label="b"]', 'q0 [label="a"]', 10),
        ('q0 [label="b"]', 'q0 [label="c"]', 10),
        ('q0 [label="b"]', 'q0 [label="b / x"]', 10),
        ('q0 [label="b"]', 'q0 [label="\\"b"]', 10),
        ('q0 [label="b"]', "q0 [label=b]", 10),
        ("}\n", "", 12),
        ("}\n", "}\n}\n", 13),
        ("}\n", "  // a comment\n}\n", 12),
    ],
)
def test_what_palpate_did_not_write_is_refused_in_a_clear_line(old, new, line):
    assert old in TEXT
    with pytest.raises(ConfigurationError) as refused:
        from_dot_text(TEXT.replace(old, new, 1))
    assert len(str(refused.value).splitlines()) == 1
    if line is not None:
        assert refused.value.field == f"DOT file, line {line}"


@pytest.mark.parametrize("text", ["", "{", "graph {}", "digraph { a -> b }", 'digraph automaton {\n  kind="dfa";\n'])
def test_other_texts_are_refused_in_a_clear_line(text):
    with pytest.raises(ConfigurationError, match="palpate did not write") as refused:
        from_dot_text(text)
    assert len(str(refused.value).splitlines()) == 1


@given(st.data())
def test_a_damaged_file_is_either_refused_or_another_machine(data):
    at = data.draw(st.integers(0, len(TEXT) - 2))
    damaged = TEXT[:at] + data.draw(st.sampled_from(["", '"', "\\", "{", "\n", "q9"])) + TEXT[at + 1 :]
    try:
        read = from_dot_text(damaged)
    except ConfigurationError:
        return
    # Only a name can change and leave a machine.
    assert to_dot_text(read).splitlines() == damaged.splitlines()
