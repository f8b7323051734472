"""What policies over symbols alone can do at best in grid worlds."""

from math import inf

import pytest

from benchmarks.grid import best_actions, best_fixed_actions
from palpate.core.errors import ConfigurationError
from palpate.core.policy.base import COMPASS_NAMES
from palpate.simulation.grid.maps import SCENARIO_1, SCENARIO_2, TWIN, GridMap


def named(grid: GridMap) -> dict[str, tuple[str, ...]]:
    return {
        symbol: tuple(COMPASS_NAMES[action] for action in actions)
        for symbol, actions in zip(grid.symbols, best_actions(grid), strict=True)
    }


@pytest.mark.parametrize("size", [5, 7])
def test_in_scenario_1_just_the_replicated_symbols_have_no_best_action(size: int) -> None:
    assert named(GridMap.from_regions(SCENARIO_1, size)) == {
        "A": ("+x-y",), "B": (), "C": (), "D": ("+y",), "E": ("-x",), "F": ("-x+y",),
    }  # fmt: skip


@pytest.mark.parametrize("notation", [SCENARIO_2, TWIN])
def test_in_scenario_2_no_symbol_has_one(notation: str) -> None:
    assert set(named(GridMap.from_regions(notation)).values()) == {()}


def test_several_actions_may_be_equally_good() -> None:
    assert named(GridMap.from_text("AAB·"))["A"] == ("+x",)
    assert named(GridMap.from_text("#A.\nCAB"))["C"] == ("+x", "+x+y")


@pytest.mark.parametrize(("notation", "steps", "reaches"), [(SCENARIO_2, 34.9583, 0.6875), (TWIN, 47.7708, 0.5417)])
def test_the_best_fixed_actions_are_those_of_another_program(notation: str, steps: float, reaches: float) -> None:
    best = best_fixed_actions(GridMap.from_regions(notation))
    assert (best.limited_steps, best.reaches) == (pytest.approx(steps, abs=5e-5), pytest.approx(reaches, abs=5e-5))
    assert best.steps == inf


def test_the_best_fixed_actions_by_hand() -> None:
    # Right is best where A is: the two on the left arrive, the one on the right does not.
    best = best_fixed_actions(GridMap.from_text("AA·A"), step_limit=10)
    assert (best.limited_steps, best.reaches) == (pytest.approx((2 + 1 + 10) / 3), pytest.approx(2 / 3))
    # With fewer steps than there are cells, a way that is too long counts as none.
    assert best_fixed_actions(GridMap.from_text("AAA·"), step_limit=2).limited_steps == pytest.approx((2 + 2 + 1) / 3)


def test_where_every_region_has_its_own_symbol_they_are_the_optimum() -> None:
    assert best_fixed_actions(GridMap.from_text("ABC\nD·E\n")).steps == pytest.approx(1.0)


def test_too_many_symbols_are_refused() -> None:
    with pytest.raises(ConfigurationError, match="at most 6"):
        best_fixed_actions(GridMap.from_regions("ABC/D·E/FGH", 3))
