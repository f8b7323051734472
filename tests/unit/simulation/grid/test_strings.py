"""Strings of random walks, and their files."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.core.errors import ConfigurationError, OutputError
from palpate.simulation.grid.maps import SCENARIO_1, GridMap
from palpate.simulation.grid.strings import load_strings, save_strings, strings_in, strings_text, walk_strings
from tests.unit.simulation.grid.test_maps import can_print

GRID = GridMap.from_regions(SCENARIO_1)
symbols = st.sampled_from(["A", "B", "C"]) | st.sampled_from(["gap", "x+", "#"])


def test_strings_are_walks_that_end_at_the_goal() -> None:
    strings = walk_strings(GRID, 60, seed=3, longest=30)
    assert len(strings) == 60
    assert len(set(strings)) > 50
    assert max(map(len, strings)) <= 30
    assert all(can_print(GRID, "".join(string)) for string in strings)


def test_a_seed_gives_its_strings_and_more_of_them_begin_with_the_same() -> None:
    assert walk_strings(GRID, 20, seed=3) == walk_strings(GRID, 50, seed=3)[:20]
    assert walk_strings(GRID, 20, seed=4) != walk_strings(GRID, 20, seed=3)
    assert walk_strings(GRID, 0, seed=3) == ()


def test_short_walks_are_those_of_the_long_ones_that_are_short() -> None:
    long = [string for string in walk_strings(GRID, 200, seed=1, longest=1000) if len(string) <= 5]
    assert list(walk_strings(GRID, len(long), seed=1, longest=5)) == long


@pytest.mark.parametrize(("count", "longest"), [(-1, 5), (1.5, 5), (5, 0)])
def test_numbers_out_of_range_are_refused(count: int, longest: int) -> None:
    with pytest.raises(ConfigurationError, match=r"grid\.(strings|longest)"):
        walk_strings(GRID, count, 0, longest)


def test_the_text_is_as_the_paper_prints_it() -> None:
    assert strings_text([("C", "A", "A"), ("E",)]) == "CAA\nE\n"
    assert strings_text([("gap", "x+"), ("A",)]) == "gap x+\nA\n"
    assert strings_in("CAA\n\n  E \n") == (("C", "A", "A"), ("E",))
    assert strings_in("gap x+\nA\n") == (("gap", "x+"), ("A",))
    assert strings_in("C A A\nAB\n", ["A", "B", "C"]) == (("C", "A", "A"), ("A", "B"))
    assert strings_in("gap\n", ["gap", "x+"]) == (("gap",),)
    assert strings_in("") == ()


@given(st.lists(st.lists(symbols, min_size=1, max_size=6), max_size=6))
def test_strings_come_back(strings: list[list[str]]) -> None:
    alphabet = sorted({symbol for string in strings for symbol in string})
    assert strings_in(strings_text(strings), alphabet) == tuple(map(tuple, strings))


@pytest.mark.parametrize("strings", [[()], [("A",), ()], [("x- y0",)], [(" A",)], [("",)]])
def test_what_no_file_can_hold_is_refused(strings: list[tuple[str, ...]]) -> None:
    with pytest.raises(ConfigurationError, match="without blanks in them"):
        strings_text(strings)


def test_a_symbol_of_another_alphabet_is_refused() -> None:
    with pytest.raises(ConfigurationError, match=r"strings\[1\] = 'D' is refused: symbols of A, B"):
        strings_in("AB\nAD\n", ["A", "B"])


def test_a_file_is_never_overwritten(tmp_path: Path) -> None:
    path = tmp_path / "walks.txt"
    save_strings([("A", "B")], path)
    with pytest.raises(OutputError, match="is there already"):
        save_strings([("B",)], path)
    assert load_strings(path) == (("A", "B"),)
    with pytest.raises(OutputError, match="cannot be written"):
        save_strings([("B",)], tmp_path / "nowhere" / "walks.txt")


def test_a_file_that_cannot_be_read_is_refused(tmp_path: Path) -> None:
    (tmp_path / "binary").write_bytes(b"\xff\xfe")
    for name in ("missing", "binary", "."):
        with pytest.raises(ConfigurationError, match=r"strings\.file"):
            load_strings(tmp_path / name)
