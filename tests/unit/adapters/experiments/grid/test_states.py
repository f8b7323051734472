"""States by name: symbols, the last few, or an automaton."""

from __future__ import annotations

from pathlib import Path

import pytest

from palpate.adapters.experiments.grid.states import Followed, Named
from palpate.core.automata.document import save
from palpate.core.automata.machine import Kind, Machine
from palpate.core.automata.tracker import AutomatonState
from palpate.core.errors import ConfigurationError
from palpate.core.perception import IdentityState, LastSymbols
from palpate.simulation.grid.maps import GridMap

GRID = GridMap.from_text("AB·")
MACHINE = Machine(Kind.MOORE, ("A", "B"), ((0, 1), (0, 1)), ("after A", "after B"))


def test_symbols_and_the_last_few() -> None:
    assert Named("symbols")(GRID) == IdentityState(("A", "B"))
    assert Named("last-3")(GRID) == LastSymbols(("A", "B"), 3)


def test_each_run_gets_an_identifier_of_its_own() -> None:
    make = Named("last-2")
    first, second = make(GRID), make(GRID)
    first.update(1)
    assert second.get_state() == []


def test_an_automaton_file(tmp_path: Path) -> None:
    save(MACHINE, tmp_path / "two.json")
    made = Named(str(tmp_path / "two.json"))(GRID)
    assert isinstance(made, AutomatonState)
    assert made.symbols == ("A", "B")
    assert [made.update(symbol) for symbol in (0, 1, 1, 0)] == [0, 1, 1, 0]


def test_an_automaton_may_know_fewer_symbols_than_the_map_and_no_others() -> None:
    few = Followed(MACHINE)(GridMap.from_text("ABC·"))
    assert few.symbols == ("A", "B", "C")
    with pytest.raises(ConfigurationError, match="all symbols of the machine"):
        Followed(MACHINE)(GridMap.from_text("AC·"))


@pytest.mark.parametrize(
    ("name", "says"),
    [
        ("magic", "state = 'magic' is refused: symbols, last-2, last-3 and so on, or an automaton file"),
        ("last-0", "state = 'last-0'"),
        ("last-99", "state = 'last-99'"),
        ("missing.json", "state = 'missing.json' is refused: a readable"),
    ],
)
def test_what_gives_no_states_is_refused(name: str, says: str) -> None:
    with pytest.raises(ConfigurationError, match=says):
        Named(name)(GRID)
