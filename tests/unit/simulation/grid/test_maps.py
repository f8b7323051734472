"""Maps: what they are made of, where moves lead, and what is no map."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.core.errors import ConfigurationError
from palpate.core.policy.base import COMPASS_NAMES
from palpate.simulation.grid.maps import COMPASS, SCENARIO_1, SCENARIOS, GridMap, grid_actions

PRINTED = "CAAABBAABBEDBBDFEEEEDEEEEC"
"""The string that the paper prints for a walk in scenario 1 (section 4)."""


def can_print(grid: GridMap, string: str) -> bool:
    """Whether some walk gives exactly these readings and then steps into the goal."""
    if not set(string) <= set(grid.symbols):
        return False
    word = [grid.symbols.index(letter) for letter in string]
    possible = {cell for cell, reading in enumerate(grid.readings) if reading == word[0]}
    for symbol in word[1:]:
        onward = {target for cell in possible for target in grid.moves[cell] if target is not None}
        possible = {cell for cell in onward if grid.readings[cell] == symbol}
    return any(None in grid.moves[cell] for cell in possible)


def test_regions_are_the_signs_from_the_goal() -> None:
    assert GridMap.from_regions("ABC/C·E/BDF", 5).rows == ("AABCC", "AABCC", "CC·EE", "BBDFF", "BBDFF")
    assert GridMap.from_regions("ABC/C.E/BDF", 3).rows == ("ABC", "C·E", "BDF")


@pytest.mark.parametrize(("name", "symbols"), [("1", "ABCDEF"), ("2", "ABCD"), ("twin", "ABCD")])
def test_scenarios_have_the_symbols_of_the_paper(name: str, symbols: str) -> None:
    grid = GridMap.from_regions(SCENARIOS[name])
    assert "".join(grid.symbols) == symbols
    assert len(grid.cells) == 48


@pytest.mark.parametrize("size", [5, 7, 9])
def test_the_printed_string_is_a_walk_of_scenario_1_that_ends_at_the_goal(size: int) -> None:
    assert can_print(GridMap.from_regions(SCENARIO_1, size), PRINTED)


def test_a_walk_by_hand() -> None:
    grid = GridMap.from_text("AB\n·C")
    assert grid.cells == ((0, 0), (1, 0), (1, 1))
    assert [grid.symbols[reading] for reading in grid.readings] == ["A", "B", "C"]
    leads = {
        (letter, name): "·" if target is None else grid.symbols[grid.readings[target]]
        for letter, row in zip("ABC", grid.moves, strict=True)
        for name, target in zip(COMPASS_NAMES, row, strict=True)
    }
    assert [leads["A", name] for name in COMPASS_NAMES] == ["B", "A", "A", "A", "A", "A", "·", "C"]
    assert leads["B", "-x-y"] == leads["C", "-x"] == "·"
    assert (leads["C", "+y"], leads["C", "-x+y"], leads["C", "+x"]) == ("B", "A", "C")


def test_walls_inside_hold_too() -> None:
    grid = GridMap.from_text("A#.\nA#A\nAAA")
    up = grid.cells.index((1, 2))
    assert grid.moves[up][COMPASS_NAMES.index("+y")] == up
    assert max(grid.distances.values()) == 4


@given(st.sampled_from(sorted(SCENARIOS)), st.sampled_from([3, 5, 7, 11]))
def test_every_move_can_be_taken_back(name: str, size: int) -> None:
    grid = GridMap.from_regions(SCENARIOS[name], size)
    for cell, row in enumerate(grid.moves):
        for action, target in enumerate(row):
            if target is not None and target != cell:
                assert grid.moves[target][(action + 4) % 8] == cell


def test_actions_are_those_of_the_insertion_task() -> None:
    assert tuple(action.name for action in grid_actions()) == COMPASS_NAMES
    assert [action.displacement_m for action in grid_actions()[:2]] == [(1e-3, 0.0), (1e-3, 1e-3)]
    assert len(set(COMPASS)) == 8


def test_a_map_reads_back() -> None:
    grid = GridMap.from_regions(SCENARIO_1)
    assert GridMap.from_text(f"\n{grid}\n") == grid
    assert hash(GridMap(grid.rows)) == hash(grid)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "at least one row"),
        ("ABC\nDEF", "0 goals in ABC/DEF' is refused: one goal, · or ."),
        ("A·B\nC.D", "2 goals"),
        ("·", "at least one cell beside the goal"),
        ("ABC\nC·\nBDF", "2 cells in row 2' is refused: 3 cells, as in the first row"),
        ("ABc\nC·E\nBDF", "c in row 1' is refused: capital letters A to Z"),
        ("AB1\nC·E\nBDF", "1 in row 1"),
        ("A B\nC·E", "  in row 1"),
        ("A#B\n##·", "column 1 of row 1' is refused: a cell from which the goal can be reached"),
        ("A" * 100 + "·", "at most 99 each"),
    ],
)
def test_what_is_no_map_is_refused_in_one_line(text: str, says: str) -> None:
    with pytest.raises(ConfigurationError) as refused:
        GridMap.from_text(text)
    assert str(refused.value).startswith("grid.map = ")
    assert says in str(refused.value)
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize("size", [0, -7, 1, 6, 101, 7.0, True])
def test_a_side_is_odd(size: int) -> None:
    with pytest.raises(ConfigurationError, match=r"grid\.size = .* is refused: an odd number of cells from 3 to 99"):
        GridMap.from_regions(SCENARIO_1, size)


@pytest.mark.parametrize(
    "notation", ["ABC", "ABC/CDE/BDF", "ABC/C··/BDF", "ABCD/C·E/BDF", "AB/C·E/BDF", "", "ABC/·CE/BDF"]
)
def test_regions_are_three_rows_of_three_with_the_goal_in_the_middle(notation: str) -> None:
    with pytest.raises(ConfigurationError, match="three rows of three regions"):
        GridMap.from_regions(notation)
