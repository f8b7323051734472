from dataclasses import replace

import pytest

from palpate.core.automata.machine import Kind, Machine
from palpate.core.errors import CommandError, ConfigurationError
from tests.unit.core.automata.machines import dfa

PARITY = dfa([[1, 0], [0, 1]], [0])
HOLES = dfa([[1, None], [None, None]], [1])
MOORE = Machine(Kind.MOORE, ("a",), ((1,), (0,)), ("x", ("y", "z")))


def test_a_word_leads_to_a_state_and_an_output():
    assert [PARITY.state_after(word) for word in [(), (0,), (0, 1), (0, 0)]] == [0, 1, 1, 0]
    assert [PARITY.output_of(word) for word in [(), (0,), (0, 1), (0, 0)]] == [True, False, False, True]
    assert MOORE.output_of((0,)) == ("y", "z")


def test_beyond_what_is_known_there_is_no_state_and_no_output():
    assert HOLES.state_after((0, 0, 1)) is None
    assert HOLES.output_of((1,)) is None


def test_symbols_have_numbers():
    assert PARITY.symbol("b") == 1
    with pytest.raises(CommandError, match="one of a, b: 'c'"):
        PARITY.symbol("c")


def test_a_complete_machine_has_every_transition():
    assert PARITY.complete
    assert not HOLES.complete


def test_numbered_labels_are_no_labels():
    assert replace(PARITY, labels=("s0", "s1")) == PARITY
    assert replace(PARITY, labels=("s1", "s0")).labels == ("s1", "s0")


@pytest.mark.parametrize(
    ("machine", "changes", "field"),
    [
        (PARITY, {"alphabet": ()}, "alphabet"),
        (PARITY, {"alphabet": ("a", "a")}, "alphabet"),
        (PARITY, {"alphabet": ("a", "")}, "alphabet"),
        (PARITY, {"alphabet": ("a", 1)}, "alphabet"),
        (PARITY, {"labels": ("p",)}, "labels"),
        (PARITY, {"labels": ("p", "p")}, "labels"),
        (PARITY, {"transitions": (), "state_outputs": ()}, "transitions"),
        (PARITY, {"transitions": ((0, 0), (0,))}, "transitions[1]"),
        (PARITY, {"transitions": ((0, 0), (0, 2))}, "transitions[1][1]"),
        (PARITY, {"transitions": ((0, -1), (0, 0))}, "transitions[0][1]"),
        (PARITY, {"start": 2}, "start"),
        (PARITY, {"start": -1}, "start"),
        (PARITY, {"state_outputs": (True,)}, "state_outputs"),
        (PARITY, {"state_outputs": (True, "x")}, "state_outputs"),
        (MOORE, {"state_outputs": ("x", 1.5)}, "state_outputs"),
        (MOORE, {"state_outputs": ("x", None)}, "state_outputs"),
        (MOORE, {"state_outputs": ("x", ("y", 1))}, "state_outputs"),
    ],
)
def test_parts_that_do_not_fit_are_refused(machine, changes, field):
    with pytest.raises(ConfigurationError) as refused:
        replace(machine, **changes)
    assert refused.value.field == f"automaton.{field}"
    assert len(str(refused.value).splitlines()) == 1
