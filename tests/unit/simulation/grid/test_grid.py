"""Maps of grid worlds, trials on them, and the optimum."""

from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.core.errors import ConfigurationError
from palpate.core.perception import IdentityState, LastSymbols
from palpate.core.policy import Observation, RandomWalkPolicy, Transition
from palpate.core.policy.base import COMPASS_NAMES
from palpate.simulation.grid import GridMap, grid_actions, run_trial
from palpate.simulation.grid.maps import SCENARIO_1, SCENARIO_2, SCENARIOS, TWIN
from palpate.simulation.grid.optimum import belief_optimum, full_information_optimum, random_walk_steps
from palpate.simulation.grid.trial import walk_strings
from tests.unit.core.policy.bench import Diary

PRINTED = "CAAABBAABBEDBBDFEEEEDEEEEC"
"""The string that the paper prints for a walk in scenario 1 (section 4)."""


def can_print(grid, string):
    """Whether some walk gives exactly these readings and then steps into the goal."""
    if not set(string) <= set(grid.symbols):
        return False
    word = [grid.symbols.index(letter) for letter in string]
    possible = {cell for cell, reading in enumerate(grid.readings) if reading == word[0]}
    for symbol in word[1:]:
        onward = {target for cell in possible for target in grid.moves[cell] if target is not None}
        possible = {cell for cell in onward if grid.readings[cell] == symbol}
    return any(None in grid.moves[cell] for cell in possible)


def test_regions_are_the_signs_from_the_goal():
    assert GridMap.from_regions("ABC/C·E/BDF", 5).rows == ("AABCC", "AABCC", "CC·EE", "BBDFF", "BBDFF")
    assert GridMap.from_regions("ABC/C.E/BDF", 3).rows == ("ABC", "C·E", "BDF")


@pytest.mark.parametrize(("name", "symbols"), [("1", "ABCDEF"), ("2", "ABCD"), ("twin", "ABCD")])
def test_scenarios_have_the_symbols_of_the_paper(name, symbols):
    grid = GridMap.from_regions(SCENARIOS[name])
    assert "".join(grid.symbols) == symbols
    assert len(grid.cells) == 48


@pytest.mark.parametrize("size", [5, 7, 9])
def test_the_printed_string_is_a_walk_of_scenario_1_that_ends_at_the_goal(size):
    assert can_print(GridMap.from_regions(SCENARIO_1, size), PRINTED)


def test_a_walk_by_hand():
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


@given(st.sampled_from(sorted(SCENARIOS)), st.sampled_from([3, 5, 7, 11]))
def test_every_move_can_be_taken_back(name, size):
    grid = GridMap.from_regions(SCENARIOS[name], size)
    for cell, row in enumerate(grid.moves):
        for action, target in enumerate(row):
            if target is not None and target != cell:
                assert grid.moves[target][(action + 4) % 8] == cell


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "at least one row"),
        ("ABC\nDEF", "must be one goal, · or ."),
        ("A·B\nC.D", "2 goals"),
        ("·", "at least one cell next to the goal"),
        ("ABC\nC·\nBDF", "must be 3 cells, as in the first row"),
        ("ABc\nC·E\nBDF", "must be capital letters A to Z"),
        ("AB1\nC·E\nBDF", "1 in row 1"),
        ("A B\nC·E", "  in row 1"),
        ("A#B\n##·", "must be a cell from which the goal can be reached"),
        ("A" * 100 + "·", "at most 99 each"),
    ],
)
def test_what_is_no_map_is_refused_in_one_line(text, says):
    with pytest.raises(ConfigurationError) as refused:
        GridMap.from_text(text)
    assert str(refused.value).startswith(("grid.map must be ", "grid.map is missing"))
    assert says in str(refused.value)
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize(("size", "steps"), [(3, Fraction(1)), (5, Fraction(5, 3)), (7, Fraction(7, 3))])
def test_with_full_information_the_distance_counts(size, steps):
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
def test_belief_optima_are_those_of_another_solver(notation, size, steps):
    assert f"{float(belief_optimum(GridMap.from_regions(notation, size))):.4f}" == steps


def test_one_symbol_everywhere_by_hand():
    # From the left end or the right end of A·A is not known: one is done after one step, the other after two more,
    # because the first move ran into the wall.
    assert belief_optimum(GridMap.from_text("A·A")) == Fraction(1 + 2, 2)
    # AA·: three cells... the way is always to the right.
    assert belief_optimum(GridMap.from_text("AAA·")) == Fraction(1 + 2 + 3, 3)


def test_the_random_walk_by_hand_and_cut_off():
    # One of eight actions leads to the goal.
    grid = GridMap.from_text("A·")
    assert random_walk_steps(grid, 2) == pytest.approx(1.0 + 7.0 / 8.0)
    assert random_walk_steps(grid, 1000) == pytest.approx(8.0)


def test_a_search_that_becomes_too_long_says_so():
    with pytest.raises(ConfigurationError, match="the belief-state optimum takes less effort"):
        belief_optimum(GridMap.from_regions(SCENARIO_2), most_cells=100)


CORRIDOR = GridMap.from_text("ABB·")
GRID = GridMap.from_regions(SCENARIO_1)
RIGHT, LEFT = 0, 4


def trial_from(cell):
    """A trial of seed 0 that begins there."""
    walks = (run_trial(CORRIDOR, IdentityState(CORRIDOR.symbols), Diary(), 0, trial) for trial in range(50))
    return next(trial for trial, walk in enumerate(walks) if walk.start == cell)


def test_learning_comes_before_the_next_choice_and_sees_readings_only():
    diary, trial, zero = Diary(), trial_from(0), (0.0, 0.0, 0.0)
    walk = run_trial(CORRIDOR, LastSymbols(CORRIDOR.symbols, 2), diary, 0, trial)
    a, ab, bb = (LastSymbols(CORRIDOR.symbols, 2).states.index(name) for name in ("A", "A > B", "B > B"))
    assert diary.entries[1:] == [
        Observation(a, zero, zero, zero, zero, 0),
        Transition(a, RIGHT, -1.0, ab),
        Observation(ab, zero, zero, zero, zero, 1),
        Transition(ab, RIGHT, -1.0, bb),
        Observation(bb, zero, zero, zero, zero, 2),
        Transition(bb, RIGHT, -1.0, None),
    ]
    assert (walk.start, walk.symbols, walk.actions, walk.reached, walk.steps) == (0, (0, 1, 1), (0, 0, 0), True, 3)


def test_a_trial_that_is_cut_off_ends_with_an_ordinary_transition():
    diary = Diary((LEFT,))
    walk = run_trial(CORRIDOR, IdentityState(CORRIDOR.symbols), diary, 0, trial_from(1), step_limit=3)
    assert diary.entries[-1] == Transition(0, LEFT, -1.0, 0)
    assert (walk.symbols, walk.reached, walk.steps) == ((1, 0, 0, 0), False, 3)


def test_a_trial_depends_on_its_seed_and_its_index_alone():
    def walk(seed, trial):
        return run_trial(GRID, IdentityState(GRID.symbols), RandomWalkPolicy(grid_actions()), seed, trial)

    policy, identifier = RandomWalkPolicy(grid_actions()), IdentityState(GRID.symbols)
    in_a_row = [run_trial(GRID, identifier, policy, 5, trial) for trial in range(20)]
    assert in_a_row == [walk(5, trial) for trial in range(20)]
    assert walk(6, 3) != walk(5, 3)


def test_strings_are_walks_that_end_at_the_goal():
    strings = walk_strings(GRID, 60, seed=3, longest=30)
    assert strings.alphabet == GRID.symbols
    assert not strings.labelled
    assert len(strings.words) == 60
    assert len(set(strings.words)) > 50
    assert max(map(len, strings.words)) <= 30
    assert all(can_print(GRID, "".join(GRID.symbols[symbol] for symbol in word)) for word in strings.words)
