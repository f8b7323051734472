"""What is possible with full information, and when only readings are known."""

from fractions import Fraction

import pytest

from palpate.core.errors import ConfigurationError
from palpate.simulation.grid.maps import SCENARIO_1, SCENARIO_2, SCENARIOS, TWIN, GridMap
from palpate.simulation.grid.optimum import belief_optimum, full_information_optimum, random_walk_steps


@pytest.mark.parametrize(("size", "steps"), [(3, Fraction(1)), (5, Fraction(5, 3)), (7, Fraction(7, 3))])
def test_with_full_information_the_distance_counts(size: int, steps: Fraction) -> None:
    for name in SCENARIOS:
        assert full_information_optimum(GridMap.from_regions(SCENARIOS[name], size)) == steps


@pytest.mark.parametrize(
    ("notation", "size", "steps"),
    [
        (SCENARIO_1, 5, "2.0833"),
        (SCENARIO_1, 7, "2.7083"),
        (SCENARIO_1, 9, "3.3000"),
        (SCENARIO_2, 7, "3.2083"),
        (SCENARIO_2, 9, "3.9500"),
        (TWIN, 7, "3.2500"),
        (TWIN, 9, "3.8000"),
        ("ABA/C·C/DBD", 7, "3.9583"),
        ("ABC/C·D/DBA", 7, "3.5000"),
    ],
)
def test_belief_optima_are_those_of_another_solver(notation: str, size: int, steps: str) -> None:
    assert f"{float(belief_optimum(GridMap.from_regions(notation, size))):.4f}" == steps


def test_where_every_region_has_its_own_symbol_the_way_is_known() -> None:
    grid = GridMap.from_regions("ABC/D·E/FGH")
    assert belief_optimum(grid) == full_information_optimum(grid)


def test_one_symbol_everywhere_by_hand() -> None:
    # From the left end or the right end of A·A is not known: one is done after one step, the other after two more,
    # because the first move ran into the wall.
    assert belief_optimum(GridMap.from_text("A·A")) == Fraction(1 + 2, 2)
    # AA·: three cells... the way is always to the right.
    assert belief_optimum(GridMap.from_text("AAA·")) == Fraction(1 + 2 + 3, 3)


def test_places_that_walls_push_together_count_together() -> None:
    # Left first: then both possible places are the left end, and it is two to the right. Right first is better: one
    # place is done, the other is the end before it.
    grid = GridMap.from_text("AA·A")
    assert belief_optimum(grid) == Fraction(1 + 2 + 3, 3)


def test_the_random_walk_by_hand_and_cut_off() -> None:
    # One of eight actions leads to the goal.
    grid = GridMap.from_text("A·")
    assert random_walk_steps(grid, 2) == pytest.approx(1.0 + 7.0 / 8.0)
    assert random_walk_steps(grid, 1000) == pytest.approx(8.0)


def test_a_search_that_becomes_too_long_says_so() -> None:
    with pytest.raises(ConfigurationError, match="the belief-state optimum takes less effort"):
        belief_optimum(GridMap.from_regions(SCENARIO_2), most_cells=100)


def test_where_nothing_is_told_apart_the_search_ends_early() -> None:
    # It would be found after looking at 595 000 cells, which takes twelve seconds; 7 x 7 would be given up after more.
    with pytest.raises(ConfigurationError, match="takes less effort"):
        belief_optimum(GridMap.from_regions("AAA/A.A/AAA", 5))
