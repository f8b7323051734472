"""Actions that commute: learned from symbols and actions alone, and used only where they do."""

import numpy as np
import pytest
from numpy.typing import NDArray

from palpate.core.policy.memory.clone_fit import fit_clones
from palpate.core.policy.memory.commuting import commuting_steps
from palpate.core.policy.memory.recorded import RecordedTrial
from palpate.simulation.grid import Disturbance, GridMap, grid_actions
from tests.unit.core.policy.memory.worlds import AMBIGUOUS, STEPS, random_trials

_FOUR = ((1, 0), (0, 1), (-1, 0), (0, -1))
_EIGHT = ((1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1))
_Moves = NDArray[np.intp]


def _walks(moves: _Moves, readings: _Moves, count: int, limit: int = 100) -> list[RecordedTrial]:
    """Random walks in any world, (actions, states) to states, whose last state is the goal."""
    rng, goal, found = np.random.default_rng(0), moves.shape[1] - 1, []
    for _ in range(count):
        state, read, done = int(rng.integers(goal)), list[int](), list[int]()
        while state != goal and len(done) < limit:
            read.append(int(readings[state]))
            done.append(int(rng.integers(len(moves))))
            state = int(moves[done[-1], state])
        if state != goal:
            read.append(int(readings[state]))
        found.append(RecordedTrial(tuple(read), tuple(done), state == goal))
    return found


def _torus(side: int, steps: tuple[tuple[int, int], ...]) -> _Moves:
    cells = [(x, y) for y in range(side) for x in range(side)]
    return np.array([[(x + u) % side + side * ((y + v) % side) for x, y in cells] for u, v in steps])


def _turning(side: int) -> _Moves:
    """Left, right, forward: states are cells and headings."""
    left, right, forward = [], [], []
    for state in range(4 * side * side):
        cell, heading = divmod(state, 4)
        x, y, (u, v) = cell % side, cell // side, _FOUR[heading]
        free = 0 <= x + u < side and 0 <= y + v < side
        left.append(4 * cell + (heading + 1) % 4)
        right.append(4 * cell + (heading - 1) % 4)
        forward.append(4 * (cell + u + side * v) + heading if free else state)
    return np.array([left, right, forward])


@pytest.mark.parametrize("slips", [0.0, 0.1])
@pytest.mark.parametrize("misreads", [0.0, 0.05])
def test_displacements_are_learned_up_to_how_the_plane_lies(slips: float, misreads: float) -> None:
    disturbance = Disturbance(slips=slips, misreads=misreads)
    found = commuting_steps(random_trials(AMBIGUOUS, 250, disturbance=disturbance), 8)
    assert found is not None
    basis = np.array([found[STEPS.index((1, 0))], found[STEPS.index((0, 1))]])
    assert abs(round(float(np.linalg.det(basis)))) == 1
    assert (np.array(STEPS) @ basis).tolist() == [list(step) for step in found]


def test_where_order_matters_or_nothing_is_undone_there_are_no_displacements() -> None:
    rng = np.random.default_rng(1)
    permuted = [rng.permutation(30) for _ in range(4)]
    both_ways = np.array([way for one in permuted for way in (one, np.argsort(one))])
    worlds = [_turning(4), _torus(6, ((1, 0), (0, 1))), rng.integers(30, size=(4, 30)), both_ways]
    for moves in worlds:
        readings = rng.integers(3, size=moves.shape[1])
        assert commuting_steps(_walks(moves, readings, 150), len(moves)) is None


@pytest.mark.parametrize("text", ["AAA\nA·A\nAAA", "AB·BA"])
def test_symbols_that_are_all_the_same_and_a_line_show_no_displacements(text: str) -> None:
    grid = GridMap.from_text(text)
    assert commuting_steps(random_trials(grid, 100), len(grid_actions())) is None


@pytest.mark.parametrize("count", [1, 5, 20])
def test_few_trials_show_none(count: int) -> None:
    assert commuting_steps(random_trials(AMBIGUOUS, count), 8) is None


@pytest.mark.parametrize(("slips", "misreads", "count"), [(0.0, 0.0, 300), (0.1, 0.0, 150), (0.0, 0.05, 150)])
def test_a_commuting_map_has_clones_for_places_and_the_shares_of_what_goes_wrong(
    slips: float, misreads: float, count: int
) -> None:
    disturbance = Disturbance(slips=slips, misreads=misreads)
    trials = random_trials(AMBIGUOUS, count, limit=100, disturbance=disturbance)
    (found,) = fit_clones(trials, 3, 8, merging=True, misreading=True, commuting=True)
    assert len(AMBIGUOUS.cells) - 1 <= len(found.clones) <= 2 * len(AMBIGUOUS.cells)  # all but the goal
    assert found.fails == pytest.approx(slips, abs=0.03)
    assert found.misread == pytest.approx(misreads, abs=0.02)
    (other,) = fit_clones(trials, 3, 8, guesses=1, kept=1)
    held = random_trials(AMBIGUOUS, 40, seed=1, disturbance=disturbance)
    assert found.log_loss(held) < other.log_loss(held)


def test_a_torus_taken_for_a_plane_foretells_worse_and_models_are_those_of_before() -> None:
    moves = _torus(5, _EIGHT)
    trials = _walks(moves, np.random.default_rng(1).integers(4, size=25), 100)
    assert commuting_steps(trials, 8) is not None
    (one,), (other,) = (fit_clones(trials, 4, 8, guesses=1, kept=1, commuting=how) for how in (True, False))
    assert one.clones == other.clones
    assert one.transitions.tolist() == other.transitions.tolist()


def test_where_actions_do_not_commute_models_are_those_of_before() -> None:
    moves = _turning(3)
    trials = _walks(moves, np.arange(36) // 4 % 3, 12, limit=40)
    (one,), (other,) = (fit_clones(trials, 3, 3, guesses=1, kept=1, commuting=how) for how in (True, False))
    assert one.transitions.tolist() == other.transitions.tolist()
