import json
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.core.automata import Kind, Machine, document, to_json_text
from palpate.core.automata.document import from_json_text
from palpate.core.errors import ConfigurationError
from tests.unit.core.automata.machines import dfa, machines
from tests.unit.core.json_changes import put, remove, repeat, require_refused

PARITY = dfa([[1, 0], [0, None]], [0], labels=("even", "odd"))
MOORE = Machine(Kind.MOORE, ("a",), ((0,),), (("x", "y"),))
TEXT = """\
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


def test_the_file_looks_as_documented():
    assert to_json_text(PARITY) == TEXT
    assert "".join(f"    {line}\n" for line in TEXT.splitlines()) in document.__doc__
    assert json.loads(to_json_text(MOORE))["states"] == [{"name": "s0", "output": ["x", "y"], "next": {"a": "s0"}}]


@given(machines(), st.booleans(), st.data())
def test_a_machine_reads_back_and_gives_the_same_bytes(machine, named, data):
    names = st.text(min_size=1) | st.sampled_from(["\ud800", "s0", "null"])
    if named:
        count = len(machine.transitions)
        machine = replace(
            machine, labels=tuple(data.draw(st.lists(names, min_size=count, max_size=count, unique=True)))
        )
    count = len(machine.alphabet)
    machine = replace(machine, alphabet=tuple(data.draw(st.lists(names, min_size=count, max_size=count, unique=True))))
    text = to_json_text(machine)
    assert text.isascii()
    assert from_json_text(text) == machine
    assert to_json_text(from_json_text(text)) == text


BAD_ACCEPTORS = [
    (remove("schema"), "schema"),
    (put("schema", "palpate.automaton/1"), "schema"),
    *[(remove(key), "automaton file") for key in ("kind", "alphabet", "start", "states")],
    (put("comment", ""), "automaton file"),
    (put("kind", "nfa"), "kind"),
    (put("kind", "mealy"), "kind"),
    (put("alphabet", "ab"), "alphabet"),
    (put("alphabet", ["a", ""]), "alphabet[1]"),
    (put("alphabet", ["a", "c"]), "states[0].next"),
    (put("alphabet", ["a"]), "states[0].next"),
    (put("start", "none"), "start"),
    (put("start", 0), "start"),
    (put("states", []), "states"),
    (remove("states", 1, "output"), "states[1]"),
    (repeat("states"), "states[2]"),
    (put("states", 1, "name", ""), "states[1]"),
    (put("states", 1, "name", 5), "states[1].name"),
    (put("states", 0, "output", "x"), "states[0].output"),
    (put("states", 0, "next", ["odd", "even"]), "states[0].next"),
    (put("states", 0, "next", "a", "gone"), "states[0].next.a"),
    (put("states", 0, "next", "a", ["odd"]), "states[0].next.a"),
    (remove("states", 0, "next", "a"), "states[0].next"),
]


@pytest.mark.parametrize(
    ("machine", "change", "field"),
    [(PARITY, *bad) for bad in BAD_ACCEPTORS] + [(MOORE, put("states", 0, "output", ["x", 1]), "states[0].output")],
)
def test_every_bad_file_is_one_clear_line(machine, change, field):
    made = json.loads(to_json_text(machine))
    change(made)
    require_refused(from_json_text, made, field)


@given(st.data())
def test_a_damaged_file_is_either_refused_or_a_machine(data):
    at = data.draw(st.integers(0, len(TEXT) - 1))
    damaged = TEXT[:at] + data.draw(st.sampled_from(["", '"', "{", "null", "\n", "a"])) + TEXT[at + 1 :]
    try:
        read = from_json_text(damaged)
    except ConfigurationError:
        return
    assert from_json_text(to_json_text(read)) == read
