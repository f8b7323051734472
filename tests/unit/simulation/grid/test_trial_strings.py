from pathlib import Path

import pytest

from palpate.adapters.files import read_strings, write_strings
from palpate.core.errors import ConfigurationError
from palpate.simulation.grid.maps import SCENARIO_1, GridMap
from palpate.simulation.grid.trial import walk_strings
from tests.unit.simulation.grid.test_maps import can_print

GRID = GridMap.from_regions(SCENARIO_1)


def test_strings_are_walks_that_end_at_the_goal() -> None:
    strings = walk_strings(GRID, 60, seed=3, longest=30)
    assert strings.alphabet == GRID.symbols
    assert not strings.labelled
    assert len(strings.words) == 60
    assert len(set(strings.words)) > 50
    assert max(map(len, strings.words)) <= 30
    assert all(can_print(GRID, "".join(GRID.symbols[symbol] for symbol in word)) for word in strings.words)


def test_a_seed_gives_its_strings_and_more_of_them_begin_with_the_same() -> None:
    assert walk_strings(GRID, 20, seed=3).words == walk_strings(GRID, 50, seed=3).words[:20]
    assert walk_strings(GRID, 20, seed=4).words != walk_strings(GRID, 20, seed=3).words


def test_short_walks_are_those_of_the_long_ones_that_are_short() -> None:
    long = tuple(word for word in walk_strings(GRID, 200, seed=1, longest=1000).words if len(word) <= 5)
    assert walk_strings(GRID, len(long), seed=1, longest=5).words == long


def test_they_come_back_from_a_file(tmp_path: Path) -> None:
    strings = walk_strings(GRID, 30, seed=0)
    write_strings(strings, tmp_path / "walks.txt")
    assert read_strings(tmp_path / "walks.txt") == strings


@pytest.mark.parametrize(("count", "longest", "says"), [(0, 5, "walks"), (1.5, 5, "walks"), (5, 0, "longest")])
def test_numbers_out_of_range_are_refused(count: int, longest: int, says: str) -> None:
    with pytest.raises(ConfigurationError, match=f"{says} = "):
        walk_strings(GRID, count, 0, longest)


def test_a_map_with_one_symbol_has_nothing_to_tell() -> None:
    with pytest.raises(ConfigurationError, match="two symbols or more"):
        walk_strings(GridMap.from_text("AA·"), 5, 0)
