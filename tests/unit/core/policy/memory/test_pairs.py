"""Tables of pasts: what they hold, how they are mixed, and that they learn what symbols alone cannot."""

import numpy as np
import pytest

from palpate.core.perception import IdentityState
from palpate.core.policy import Observation, PairsLearner, Transition
from palpate.core.policy.memory.recorded import RecordedTrial
from palpate.simulation.grid import GridMap, grid_actions, run_trial, walked_steps
from tests.unit.core.policy.memory.worlds import AMBIGUOUS

ZERO = (0.0, 0.0, 0.0)


def test_a_past_is_the_last_readings_and_the_actions_between_them() -> None:
    learner = PairsLearner(("A", "B"), grid_actions(), longest=3)
    assert learner.past_of([0], []) == (0,)
    assert learner.past_of([0, 1], [5]) == (0, 5, 1)
    assert learner.past_of([0, 1, 1, 0], [5, 6, 7]) == (1, 6, 1, 7, 0)


def test_a_longer_past_counts_by_how_often_it_was_tried() -> None:
    learner = PairsLearner(("A", "B"), grid_actions(), longest=2)
    learner._symbols, learner._actions = [0, 1], [5]
    learner.learn(Transition(1, 2, -1.0, None))
    # Both tables went half of the way from -4 to -1 and were tried once; mixed with -4, then with each other.
    short = -4.0 + 0.25 * 1.5
    assert learner.values((0, 5, 1))[2] == pytest.approx(short + 0.25 * (-2.5 - short))
    assert learner.values((1,))[2] == pytest.approx(short)
    assert learner.values((0, 3, 1))[2] == pytest.approx(short)


def test_a_replayed_trial_says_in_part_itself_what_is_yet_to_come() -> None:
    learner = PairsLearner(("A", "B"), grid_actions(), longest=1, returned=0.5)
    learner._replay(RecordedTrial((0, 1), (2, 3), True))
    # The last action came to -1. What follows the first is worth that in one half, and in the other what B holds then.
    assert learner.values((1,))[3] == -4.0
    assert learner._tables[1,][0][3] == -2.5
    assert learner._tables[0,][0][2] == pytest.approx(-4.0 + 0.5 * (-1.0 + 0.97 * 0.5 * (-4.0 - 1.0) + 4.0))


def test_a_frozen_one_acts_by_running_means() -> None:
    learner = PairsLearner(("A",), grid_actions(), longest=1)
    learner._tables = {(0,): ([-2.0] * 8, [99] * 8, [-2.0] * 8)}
    for target in (-9.0, 5.0, -9.0, 5.0):
        learner._update([(0,)], 0, target, 1)
    values, _, means = learner._tables[0,]
    assert abs(means[0] + 2.0) < abs(values[0] + 2.0)
    share = 103 / 106
    assert learner.as_frozen().values((0,))[0] == pytest.approx(-4.0 + share * (means[0] + 4.0))
    assert learner.values((0,))[0] == pytest.approx(-4.0 + share * (values[0] + 4.0))


def test_it_learns_where_two_places_read_alike() -> None:
    # From either A the goal is near, but on the other side; only B or C before tells which.
    grid = GridMap.from_text("BA·AC")
    learner, identity = PairsLearner(grid.symbols, grid_actions()), IdentityState(grid.symbols)
    for trial in range(300):
        run_trial(grid, identity, learner, 1, trial)
    assert walked_steps(grid, identity, learner.as_frozen(), walks=20).steps < 2.3


def test_a_state_goes_on_as_the_learner_it_is_of() -> None:
    identity, one = IdentityState(AMBIGUOUS.symbols), PairsLearner(AMBIGUOUS.symbols, grid_actions())
    for trial in range(15):
        run_trial(AMBIGUOUS, identity, one, 0, trial)
    other = PairsLearner(AMBIGUOUS.symbols, grid_actions())
    other.set_state(one.get_state())
    walks = [run_trial(AMBIGUOUS, identity, learner, 0, 15) for learner in (one, other)]
    assert walks[0] == walks[1]
    assert one.get_state() == other.get_state()


def test_a_frozen_one_leaves_a_circle_and_changes_no_value() -> None:
    learner = PairsLearner(("A",), grid_actions(), frozen=True)
    values = [0.0, -2.5, *[-9.0] * 6]
    learner._tables = {(0,): (values, [1000] * 8, values)}
    before = learner.get_state()
    learner.begin_trial(0, np.random.default_rng(0))
    taken = []
    for _ in range(6):
        taken.append(learner.choose(Observation(0, ZERO, ZERO, ZERO, ZERO, 0)).index)
        learner.learn(Transition(0, taken[-1], -1.0, 0))
    assert taken[0] == 0
    assert 1 in taken
    assert learner.get_state() == before | {"temperature": learner.temperature}
