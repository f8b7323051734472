"""The learner that acts by a belief over the hole's place, in a world of touches that is known."""

from itertools import pairwise
from math import dist

import numpy as np
import pytest

from palpate.core.errors import ConfigurationError
from palpate.core.policy import EpisodeOutcome, Observation, TaskBounds
from palpate.core.policy.belief import BeliefLearner, BeliefParameters
from palpate.core.policy.belief.contacts import TORQUE_NM
from palpate.core.policy.belief.planner import SpiralSearch
from tests.unit.core.policy.belief.simulated_contact import touch_at


def learner(*, frozen=False):
    return BeliefLearner(BeliefParameters(), TaskBounds(3.5e-3, 0.05), frozen=frozen)


def play(policy, hole_m, start_m, seed=0, most=400):
    """One trial; the hole takes the peg in when its way passes within 0.15 mm."""
    rng, place, hole = np.random.default_rng(seed), np.array(start_m), np.array(hole_m)
    policy.begin_trial(0, rng)
    names = []
    for number in range(most):
        tx, ty = np.array(touch_at(place, hole, rng).torque) * TORQUE_NM
        x, y = place.tolist()
        decision = policy.choose(Observation(0, (x, y, 0.0), (x, y, 0.0), (0.0, 0.0, -4.9), (tx, ty, 0.0), number))
        names.append(f"{decision.action.name} {decision.grounds}")
        way = np.array(decision.action.displacement_m)
        for share in np.linspace(0.0, 1.0, 20):
            if dist(place + share * way, hole) < 1.5e-4:
                policy.end_trial(EpisodeOutcome(True, (*hole_m, 0.01), 0.01))
                return names
        place = place + way
    policy.end_trial(EpisodeOutcome(False, (0.0, 0.0, 0.0), 0.0))
    return names


class TestLearner:
    @pytest.mark.parametrize("hole_m", [(0.0, 0.0), (2.9e-3, 0.3e-3), (-1.5e-3, -2.5e-3)])
    def test_search_covers_the_area(self, hole_m):
        assert len(play(learner(), hole_m, (0.5e-3, 0.5e-3))) < 400

    def test_one_trial_teaches_it_the_way(self):
        policy = learner()
        play(policy, (1.9e-3, -1.1e-3), (-2e-3, 1e-3))
        lengths = []
        for seed in range(12):
            heading = 2.4 * seed
            hole = (2e-3 * np.cos(heading), 2e-3 * np.sin(heading))
            lengths.append(len(play(policy, (float(hole[0]), float(hole[1])), (1e-3, 0.0), seed)))
        assert np.median(lengths) <= 8

    def test_belief_that_is_wrong_ends_in_a_search_of_everything(self):
        policy, rng, far = learner(), np.random.default_rng(0), np.array((-2.9e-3, 1.9e-3))
        felt = [touch_at(np.array((2e-3 - 2e-4 * k, 1e-3)), far, rng) for k in range(12)]
        # The torque leads away from the hole, and the hole was on the other side before.
        contacts = [[*touch.place, -touch.torque[0], -touch.torque[1], touch.press] for touch in felt]
        policy.set_state({"trials": [{"hole": [-29000, 19000], "contacts": contacts}], "trials_learned": 1})
        assert len(play(policy, (2.4e-3, -1.7e-3), (0.0, 0.0))) < 350

    def test_trial_that_did_not_end_in_the_hole_teaches_nothing(self):
        policy = learner()
        play(policy, (1e-3, 1e-3), (-1e-3, 0.0), most=3)
        assert policy.get_state() == {"trials": [], "trials_learned": 0}

    @pytest.mark.parametrize(
        "state",
        [
            {"trials": []},
            {"trials": [{"hole": [1, 2.5], "contacts": []}], "trials_learned": 1},
            # Of other units.
            {"trials": [{"hole": [1_000_001, 2], "contacts": []}], "trials_learned": 1},
            {"trials": [{"hole": [1, 2], "contacts": [[1, 2, 10**30, 4, 4900]]}], "trials_learned": 1},
        ],
    )
    def test_another_state_is_refused(self, state):
        policy = learner()
        with pytest.raises(ConfigurationError, match="learner"):
            policy.set_state(state)
        assert policy.get_state() == {"trials": [], "trials_learned": 0}

    def test_area_too_wide_for_a_tick_is_refused(self):
        with pytest.raises(ConfigurationError, match="at most 8 mm"):
            BeliefLearner(BeliefParameters(), TaskBounds(9e-3, 0.05), frozen=False)

    def test_search_that_leaves_gaps_is_refused(self):
        with pytest.raises(ConfigurationError, match="twice capture_mm"):
            BeliefParameters(pitch_mm=0.5)


def spiral_places(steps, radius_m=2e-3):
    search, at, found = SpiralSearch((0.0, 0.0), 3e-4, 8e-4, radius_m), (1e-3, 0.5e-3), []
    for _ in range(steps):
        dx, dy = search.next_m(at)
        at = (at[0] + dx, at[1] + dy)
        found.append(at)
    return np.array(found)


class TestPlanner:
    def test_it_begins_at_the_centre_and_covers_the_circle(self):
        way = spiral_places(90)
        assert dist(way[1], (0.0, 0.0)) < 1e-4
        ways = np.concatenate([np.linspace(a, b, 12) for a, b in pairwise(way)])
        grid = np.array([(x, y) for x in np.linspace(-2e-3, 2e-3, 41) for y in np.linspace(-2e-3, 2e-3, 41)])
        inside = grid[np.hypot(*grid.T) < 1.8e-3]
        gaps = np.array([np.hypot(*(ways - place).T).min() for place in inside])
        assert gaps.max() < 1.8e-4
