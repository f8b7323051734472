import json

import pytest

from palpate.adapters.experiments.build import identifier
from palpate.core.automata.document import to_json_text
from palpate.core.automata.machine import Kind, Machine
from palpate.core.errors import ConfigurationError
from palpate.core.perception import IdentityState, LastSymbols, stage_from_dict, stage_to_dict

SYMBOLS = ("A", "B", "C")


def test_names_of_memories():
    assert identifier("none", SYMBOLS) == IdentityState(SYMBOLS)
    assert identifier("last-2", SYMBOLS) == LastSymbols(SYMBOLS, 2)
    assert len(identifier("last-3", SYMBOLS).states) == 3 + 9 + 27


def test_an_automaton_s_states_survive_their_way_into_a_policy_file(tmp_path):
    path = tmp_path / "automaton.json"
    path.write_text(
        to_json_text(Machine(Kind.MOORE, ("C", "A", "B"), ((None, 1, 0), (None, 0, None)), ("even", "odd")))
    )
    states = identifier(str(path), SYMBOLS)
    assert states.states == ("s0", "s1", "lost")
    again = stage_from_dict(json.loads(json.dumps(stage_to_dict(states))))
    assert again == states
    for symbol, state in ((0, 1), (1, 2), (0, 1), (2, 2), (1, 2)):
        assert states.update(symbol) == again.update(symbol) == state, symbol


@pytest.mark.parametrize(
    ("memory", "accepted"),
    [("last", "last-2"), ("last-0", "last-2"), ("", "none"), ("last-60", "states"), ("gone.json", "readable file")],
)
def test_memories_that_cannot_be_had_are_refused_by_their_setting(memory, accepted):
    with pytest.raises(ConfigurationError, match=r"perception\.memory") as told:
        identifier(memory, SYMBOLS)
    assert accepted in told.value.accepted
