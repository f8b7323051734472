"""Memories by name."""

from __future__ import annotations

import pytest

from palpate.adapters.state_memory import identifier
from palpate.core.errors import ConfigurationError
from palpate.core.perception import IdentityState, LastSymbols

SYMBOLS = ("A", "B", "C")


def test_names_of_memories() -> None:
    assert identifier("none", SYMBOLS) == IdentityState(SYMBOLS)
    assert identifier("last-2", SYMBOLS) == LastSymbols(SYMBOLS, 2)
    assert len(identifier("last-3", SYMBOLS).states) == 3 + 9 + 27


@pytest.mark.parametrize(
    ("memory", "accepted"), [("last", "last-2"), ("last-0", "last-2"), ("", "none"), ("last-60", "states")]
)
def test_memories_that_cannot_be_had_are_refused_by_their_setting(memory: str, accepted: str) -> None:
    with pytest.raises(ConfigurationError, match=r"perception\.memory") as told:
        identifier(memory, SYMBOLS)
    assert accepted in told.value.accepted
