"""Trials: the agent sees readings alone, learns as in the insertion task, and each trial can be repeated."""

import numpy as np
import pytest

from palpate.core.errors import CommandError, ConfigurationError
from palpate.core.perception import IdentityState, LastSymbols
from palpate.core.policy import Observation, QLearning, QParameters, RandomWalkPolicy, TemperatureSchedule, Transition
from palpate.simulation.grid import GridMap, Walker, grid_actions, run_trial, walks_from_all_cells
from palpate.simulation.grid.maps import SCENARIO_1
from tests.unit.core.policy.bench import Diary

CORRIDOR = GridMap.from_text("ABB·")
GRID = GridMap.from_regions(SCENARIO_1)
RIGHT, LEFT = 0, 4


def trial_from(cell: int) -> int:
    """A trial of seed 0 that begins there."""
    walks = (run_trial(CORRIDOR, IdentityState(CORRIDOR.symbols), Diary(), 0, trial) for trial in range(50))
    return next(trial for trial, walk in enumerate(walks) if walk.start == cell)


def test_learning_comes_before_the_next_choice_and_sees_readings_only() -> None:
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


def test_a_trial_that_is_cut_off_ends_with_an_ordinary_transition() -> None:
    diary = Diary((LEFT,))
    walk = run_trial(CORRIDOR, IdentityState(CORRIDOR.symbols), diary, 0, trial_from(1), step_limit=3)
    assert diary.entries[-1] == Transition(0, LEFT, -1.0, 0)
    assert (walk.symbols, walk.reached, walk.steps) == ((1, 0, 0, 0), False, 3)


def test_a_trial_depends_on_its_seed_and_its_index_alone() -> None:
    def walk(seed: int, trial: int) -> object:
        return run_trial(GRID, IdentityState(GRID.symbols), RandomWalkPolicy(grid_actions()), seed, trial)

    policy, identifier = RandomWalkPolicy(grid_actions()), IdentityState(GRID.symbols)
    in_a_row = [run_trial(GRID, identifier, policy, 5, trial) for trial in range(20)]
    assert in_a_row == [walk(5, trial) for trial in range(20)]
    assert walk(6, 3) != walk(5, 3)


def test_every_cell_is_a_start_and_none_more_often_than_others() -> None:
    identifier, policy = IdentityState(GRID.symbols), Diary((LEFT,))
    starts = [run_trial(GRID, identifier, policy, 1, trial, step_limit=1).start for trial in range(4800)]
    counts = np.bincount(starts, minlength=48)
    assert len(counts) == 48
    assert counts.min() > 65
    assert counts.max() < 135


def test_the_learner_of_the_insertion_task_learns_here() -> None:
    grid = GridMap.from_regions("ABC/D·E/FGH", 5)
    parameters = QParameters(alpha=0.5, gamma=1.0, temperature=TemperatureSchedule(1.0, 0.97, 0.05))
    learner = QLearning(grid.symbols, grid_actions(), parameters)
    steps = [run_trial(grid, IdentityState(grid.symbols), learner, 0, trial).steps for trial in range(300)]
    assert np.mean(steps[:20]) > 5.0
    assert np.mean(steps[-100:]) < 1.9  # 1.667 with full information


def test_an_action_that_is_not_of_the_set_is_refused() -> None:
    with pytest.raises(CommandError, match="one of the set: 'far'"):
        run_trial(CORRIDOR, IdentityState(CORRIDOR.symbols), Diary((None,)), 0, 0)


def test_an_identifier_of_other_symbols_is_refused() -> None:
    with pytest.raises(ConfigurationError, match=r"grid\.state .* the symbols of the map, A, B"):
        run_trial(CORRIDOR, IdentityState(("A", "C")), Diary(), 0, 0)


@pytest.mark.parametrize("limit", [0, -1, 1.5])
def test_a_limit_is_at_least_one_step(limit: int) -> None:
    with pytest.raises(ConfigurationError, match=r"grid\.step_limit"):
        run_trial(CORRIDOR, IdentityState(CORRIDOR.symbols), Diary(), 0, 0, step_limit=limit)


def test_a_walker_is_the_same_trial_for_a_decider_outside() -> None:
    diary = Diary((RIGHT, LEFT, RIGHT, RIGHT, RIGHT))
    trial = trial_from(0)
    walk = run_trial(CORRIDOR, LastSymbols(CORRIDOR.symbols, 2), diary, 0, trial)
    walker = Walker(CORRIDOR, LastSymbols(CORRIDOR.symbols, 2), 0, trial)
    given: list[object] = []
    for action in walk.actions:
        before = walker.observation()
        following = walker.move(action)
        given += [before, Transition(before.state, action, -1.0, following)]
    assert given == diary.entries[1:]
    assert walker.walk == walk
    assert walker.cell is None
    assert walker.steps == walk.steps
    with pytest.raises(CommandError, match="at the goal there is no move"):
        walker.move(RIGHT)


def test_all_cells_are_starts_as_often_as_is_asked() -> None:
    identity = IdentityState(CORRIDOR.symbols)
    walks = walks_from_all_cells(CORRIDOR, identity, Diary(), walks=2)
    assert [(walk.start, walk.steps, walk.reached) for walk in walks[::2]] == [(0, 3, True), (1, 2, True), (2, 1, True)]
    assert walks[1::2] == walks[::2]
    never = walks_from_all_cells(CORRIDOR, identity, Diary((LEFT,)), step_limit=5)
    assert [(walk.steps, walk.reached) for walk in never] == [(5, False)] * 3
