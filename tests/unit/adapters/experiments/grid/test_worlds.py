"""Maps and states by their names, and what is possible."""

from pathlib import Path

import pytest

from palpate.adapters.experiments.grid.worlds import bounds_of, grid_named, states_named
from palpate.core.automata import Kind, Machine, to_json_text
from palpate.core.errors import ConfigurationError
from palpate.core.perception import IdentityState, LastSymbols
from palpate.simulation.grid.maps import SCENARIO_1, GridMap


def test_a_map_is_a_scenario_regions_or_a_file(tmp_path):
    assert grid_named("1", 5) == GridMap.from_regions(SCENARIO_1, 5)
    assert grid_named("ABC/C.E/BDF", 7) == GridMap.from_regions(SCENARIO_1)
    (tmp_path / "map.txt").write_text("AB#\n.BA\n")
    assert grid_named(str(tmp_path / "map.txt"), 7).rows == ("AB#", "·BA")


def test_a_file_whose_path_looks_like_regions_is_a_file(tmp_path, monkeypatch):
    folder = tmp_path / "a" / "b"
    folder.mkdir(parents=True)
    (folder / "c").write_text("AB.")
    monkeypatch.chdir(tmp_path)
    assert grid_named("a/b/c", 7).rows == ("AB·",)


@pytest.mark.parametrize(
    ("name", "size", "says"),
    [
        ("3", 7, "one of 1, 2, twin, eight regions such as ABC/C.E/BDF, or a readable text file"),
        ("missing.txt", 7, "a readable text file"),
        (".", 7, "a readable text file"),
        ("binary", 7, "a text file in UTF-8; its byte 0 is not"),
        ("none", 7, "0 goals"),
        ("1", 6, "an odd number"),
        ("ABC/C.E", 7, "a readable text file"),
        ("ABC/CXE/BDF", 7, "three rows of three regions"),
    ],
)
def test_what_is_no_map_is_refused(name, size, says, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("binary").write_bytes(b"\xff\xfe")
    Path("none").write_text("ABC")
    with pytest.raises(ConfigurationError, match=says):
        grid_named(name, size)


def test_where_the_belief_state_optimum_takes_too_long_there_is_none(monkeypatch):
    def refuse(grid):
        raise ConfigurationError("grid.map", "it", "another")

    monkeypatch.setattr("palpate.adapters.experiments.grid.worlds.belief_optimum", refuse)
    assert bounds_of(grid_named("twin", 9)).belief is None


GRID = GridMap.from_text("AB·")
MACHINE = Machine(Kind.MOORE, ("A", "B"), ((0, 1), (0, 1)), ("after A", "after B"))


def test_symbols_and_the_last_few():
    assert states_named("symbols", GRID) == IdentityState(("A", "B"))
    assert states_named("last-3", GRID) == LastSymbols(("A", "B"), 3)


@pytest.mark.parametrize("cells", ["ABC·", "AC·"])
def test_an_automaton_of_another_map_is_refused(cells, tmp_path):
    path = tmp_path / "automaton.json"
    path.write_text(to_json_text(MACHINE))
    with pytest.raises(ConfigurationError, match="all symbols of the machine and no others: A, B"):
        states_named(str(path), GridMap.from_text(cells))


@pytest.mark.parametrize(
    ("name", "says"),
    [
        ("magic", "state = 'magic' is refused: symbols, last-2, last-3 and so on, or an automaton file"),
        ("last-0", "state = 'last-0'"),
        ("last-99", "state = 'last-99'"),
        ("missing.json", "state = 'missing.json' is refused: a readable"),
    ],
)
def test_what_gives_no_states_is_refused(name, says):
    with pytest.raises(ConfigurationError, match=says):
        states_named(name, GRID)
