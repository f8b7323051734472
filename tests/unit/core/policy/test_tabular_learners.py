"""Q-learning and Sarsa by hand-computed updates, and exploration by temperature."""

from math import isfinite, nan

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy.special import softmax

from palpate.core.policy import (
    MixedPolicy,
    ProgrammedPolicy,
    QLearning,
    QParameters,
    Sarsa,
    SarsaParameters,
    TemperatureSchedule,
    Transition,
)
from palpate.core.policy.exploration import boltzmann, boltzmann_probabilities
from tests.unit.core.policy.bench import CELLS, GREEDY, TWO, observation, refuse, walk_corridor

STATES = ("i", "j", "k")


def q_learning(states=("i", "j"), actions=TWO, frozen=False, **settings):
    settings = {"alpha": 0.5, "gamma": 1.0, "temperature": TemperatureSchedule(1.0, 0.9, 0.1)} | settings
    return QLearning(states, actions, QParameters(**settings), frozen=frozen)


def sarsa(frozen=False, **settings):
    settings = {"alpha": 0.5, "gamma": 1.0, "temperature": GREEDY, "trace_decay": 0.5} | settings
    made = Sarsa(STATES, TWO, SarsaParameters(**settings), frozen=frozen)
    made.begin_trial(0, np.random.default_rng(0))
    return made


def bound(state, action, after, then, earned=-1.0):
    """A transition whose next action is known, so that nothing is drawn."""
    return Transition(state, action, earned, after, then)


class TestQLearning:
    def test_updates_have_hand_computed_values(self):
        q = q_learning(alpha=0.25, gamma=0.5)
        q.learn(Transition(1, 0, -1.0, None))  # .75*0 + .25*(-1 + .5*0)
        assert q.q == ((0.0, 0.0), (-0.25, 0.0))
        q.learn(Transition(1, 1, -2.0, None))  # .25*(-2)
        assert q.q == ((0.0, 0.0), (-0.25, -0.5))
        q.learn(Transition(0, 1, -1.0, 1))  # .25*(-1 + .5*max(-.25, -.5))
        assert q.q == ((0.0, -0.28125), (-0.25, -0.5))
        q.learn(Transition(1, 0, -1.0, 0))  # .75*-.25 + .25*(-1 + .5*0)
        assert q.q == ((0.0, -0.28125), (-0.4375, -0.5))
        assert q.visits == ((0, 1), (2, 1))

    @pytest.mark.parametrize("alpha_visits", [0.0, 20.0])
    def test_corridor_is_learned_exactly(self, alpha_visits):
        schedule = TemperatureSchedule(5.0, 0.99, 1.5)
        q = q_learning(CELLS, alpha_visits=alpha_visits, alpha_floor=0.2, temperature=schedule)
        walk_corridor(q, 1500)
        best = [-(5.0 - cell) for cell in range(5)]
        back = [-1.0 + best[max(0, cell - 1)] for cell in range(5)]
        assert np.array(q.q) == pytest.approx(np.column_stack((best, back)), abs=1e-6)
        assert q.trials_learned == 1500

    def test_learning_rate_halves_after_given_visits_and_keeps_its_floor(self):
        parameters = QParameters(alpha=0.8, gamma=1.0, temperature=GREEDY, alpha_visits=4.0, alpha_floor=0.1)
        assert [parameters.learning_rate(n) for n in (0, 4, 12)] == [0.8, 0.4, 0.2]
        assert parameters.learning_rate(10**6) == 0.1
        constant = QParameters(alpha=0.3, gamma=1.0, temperature=GREEDY)
        assert constant.learning_rate(0) == constant.learning_rate(10**6) == 0.3
        refuse("policy.alpha_floor", q_learning, alpha_floor=0.6)

    def test_frozen_learner_stays_at_the_lower_of_floor_and_temperature_in_use(self):
        in_use = TemperatureSchedule(1.0, 0.9, 0.1, in_use=0.02)
        for schedule, expected in ((in_use, 0.02), (TemperatureSchedule(1.0, 0.9, 0.1), 0.1)):
            q = q_learning(frozen=True, temperature=schedule)
            q.begin_trial(0, np.random.default_rng(0))
            assert q.temperature == expected


class TestSarsa:
    def test_updates_have_hand_computed_values(self):
        q = sarsa()
        q.learn(bound(0, 1, 1, 0))  # delta -1: Q(0,1) = -.5
        assert q.q == ((0.0, -0.5), (0.0, 0.0), (0.0, 0.0))
        q.learn(bound(1, 0, 2, 1))  # delta -1: Q(1,0) = -.5, and half of it for what led here
        assert q.q == ((0.0, -0.75), (-0.5, 0.0), (0.0, 0.0))
        q.learn(bound(2, 1, None, None, -4.0))  # delta -4, traces 1, 1/2, 1/4
        assert q.q == ((0.0, -1.25), (-1.5, 0.0), (0.0, -2.0))
        assert q.visits == ((0, 1), (1, 0), (0, 1))
        assert q.trials_learned == 1

    def test_traces_replace_and_another_action_ends_them(self):
        q = sarsa(alpha=1.0, trace_decay=1.0)
        q.learn(bound(0, 0, 0, 0, 0.0))
        q.learn(bound(0, 0, 0, 1, 0.0))  # again: the trace is 1, not 2
        q.learn(bound(0, 1, 1, 0, 0.0))  # the other action: the trace of the first is gone
        q.learn(bound(1, 0, None, None, -1.0))
        assert q.q == ((0.0, -1.0), (-1.0, 0.0), (0.0, 0.0))

    def test_action_that_was_learned_with_is_taken(self):
        q = sarsa(temperature=TemperatureSchedule(1.0, 1.0, 1.0), alpha=1.0, trace_decay=0.0, initial_value=-1.0)
        q.learn(bound(1, 0, None, None, -2.0))
        q.learn(bound(1, 1, None, None, -3.0))
        for _ in range(20):
            q.learn(Transition(0, 0, 0.0, 1))
            taken = q.choose(observation(1)).index
            assert q.q[0][0] == {0: -2.0, 1: -3.0}[taken]

    def test_action_of_another_policy_counts_where_it_acts(self):
        learner = sarsa(alpha=1.0, trace_decay=0.0)
        policy = MixedPolicy(STATES, [ProgrammedPolicy(STATES, TWO, {"j": TWO[1].name}), learner])
        policy.begin_trial(0, np.random.default_rng(0))
        policy.learn(Transition(1, 1, -7.0, None))
        policy.learn(Transition(0, 0, -1.0, 1))
        assert learner.q[0][0] == -8.0
        assert policy.choose(observation(1)).source == "programmed"


finite = st.floats(allow_nan=False, allow_infinity=False)
rows = st.lists(finite, min_size=1, max_size=12)


class CountingGenerator(np.random.Generator):
    def __init__(self, number=None):
        super().__init__(np.random.PCG64(1))
        self.draws, self.number = 0, number

    def random(self, *args, **kwargs):
        self.draws += 1
        drawn = super().random(*args, **kwargs)
        return drawn if self.number is None else self.number


class TestExploration:
    @given(st.lists(st.floats(-50.0, 50.0), min_size=1, max_size=12), st.floats(0.01, 100.0))
    def test_probabilities_are_those_of_softmax(self, values, temperature):
        expected = softmax(np.array(values) / temperature)
        assert boltzmann_probabilities(values, temperature) == pytest.approx(expected, rel=1e-9, abs=1e-300)

    @given(rows, st.floats(0.0, 1e300))
    def test_probabilities_are_distribution_for_any_finite_values(self, values, temperature):
        probabilities = boltzmann_probabilities(values, temperature)
        assert all(isfinite(p) and 0.0 <= p <= 1.0 for p in probabilities)
        assert sum(probabilities) == pytest.approx(1.0)
        assert probabilities[values.index(max(values))] == max(probabilities)

    @given(rows, st.sampled_from([0.0, 1e-7, 1e-6, 0.5, 1e9]))
    def test_every_choice_takes_exactly_one_number(self, values, temperature):
        rng, twin = CountingGenerator(), np.random.Generator(np.random.PCG64(1))
        index = boltzmann(values, temperature, rng)
        twin.random()
        assert rng.draws == 1
        assert rng.bit_generator.state == twin.bit_generator.state
        assert 0 <= index < len(values)

    @given(rows, st.floats(0.0, 10.0), st.sampled_from([0.0, 0.5, 1.0 - 2.0**-53]))
    def test_impossible_action_is_never_chosen(self, values, temperature, number):
        index = boltzmann(values, temperature, CountingGenerator(number))
        assert boltzmann_probabilities(values, temperature)[index] > 0.0

    @given(st.floats(0.0, 1e6), st.floats(1e-3, 1.0), st.floats(0.0, 1e6), st.integers(0, 10**6))
    def test_schedule_is_geometric_above_its_floor(self, initial, decay, floor, trial):
        assume(floor <= initial)
        schedule = TemperatureSchedule(initial, decay, floor)
        assert schedule.at(0) == initial
        assert schedule.at(trial) == max(floor, initial * decay**trial)
        assert floor <= schedule.at(trial + 1) <= schedule.at(trial)

    @pytest.mark.parametrize("floor", [1.1, nan])
    def test_floor_above_beginning_is_refused(self, floor):
        refuse("policy.temperature.floor", TemperatureSchedule, 1.0, 0.9, floor)
