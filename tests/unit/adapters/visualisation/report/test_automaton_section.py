"""Automata on a page: as a picture and as a table, from a file or from a policy."""

from dataclasses import replace

import pytest

from palpate.adapters.visualisation.report.automaton_section import automaton_section, machine_in
from palpate.core.automata import AutomatonState, Kind, Machine
from palpate.core.errors import ConfigurationError
from palpate.core.perception import stage_to_dict
from tests.unit.adapters.visualisation.report.samples import policy, row

MACHINE = Machine(
    Kind.DFA, ("a", "b"), ((1, None), (0, 1)), state_outputs=(False, False), start=0, labels=("even", "odd")
)


def test_picture_and_table() -> None:
    section = automaton_section(MACHINE, "automaton-01", "Automaton 1", "What it is for.")
    (picture,) = section.pictures
    assert (picture.name, section.title, section.text) == ("automaton-01", "Automaton 1", ("What it is for.",))
    assert "2 states over 2 symbols" in picture.alt
    (table,) = section.tables
    assert table.head == ("state", "a", "b")
    assert table.rows == (("even", "odd", "-"), ("odd", "even", "odd"))
    assert table.caption.endswith("it starts in even")


def test_a_large_one_is_a_table_only() -> None:
    ring = Machine(Kind.DFA, ("a",), tuple(((n + 1) % 41,) for n in range(41)), state_outputs=(False,) * 41)
    section = automaton_section(ring)
    assert section.pictures == ()
    assert len(section.tables[0].rows) == 41


def test_the_automaton_of_a_policy() -> None:
    state = AutomatonState.of(MACHINE)
    document = replace(policy(row("even", "+x")), perception={"identifier": stage_to_dict(state)})
    found = machine_in(document)
    assert found is not None
    assert (found.transitions, found.names, found.start) == (MACHINE.transitions, MACHINE.names, 0)


@pytest.mark.parametrize("perception", [{}, {"identifier": {"kind": "identity", "symbols": ["a"]}}])
def test_policies_without_one(perception: dict[str, object]) -> None:
    assert machine_in(replace(policy(row("a", "+x")), perception=perception)) is None


def test_an_automaton_that_is_damaged() -> None:
    damaged = {**stage_to_dict(AutomatonState.of(MACHINE)), "transitions": [[7, 7]]}
    with pytest.raises(ConfigurationError, match="transitions"):
        machine_in(replace(policy(row("a", "+x")), perception={"identifier": damaged}))
