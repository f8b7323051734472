import json
import struct

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.core.policy import QLearning, QParameters, TemperatureSchedule, Transition
from tests.unit.core.policy.bench import CELLS, EIGHT, GREEDY, TWO, refuse, walk_corridor


def learner(states=("i", "j"), actions=TWO, **settings) -> QLearning:
    settings = {"alpha": 0.5, "gamma": 1.0, "temperature": TemperatureSchedule(1.0, 0.9, 0.1)} | settings
    frozen = {key: settings.pop(key) for key in ("frozen",) if key in settings}
    return QLearning(states, actions, QParameters(**settings), **frozen)


def bits(rows) -> list[bytes]:
    return [struct.pack("<d", value) for row in rows for value in row]


def test_updates_have_the_hand_computed_values():
    q = learner(alpha=0.25, gamma=0.5)
    q.learn(Transition(1, 0, -1.0, None))  # .75*0 + .25*(-1 + .5*0)
    assert q.q == ((0.0, 0.0), (-0.25, 0.0))
    q.learn(Transition(1, 1, -2.0, None))  # .25*(-2)
    assert q.q == ((0.0, 0.0), (-0.25, -0.5))
    q.learn(Transition(0, 1, -1.0, 1))  # .25*(-1 + .5*max(-.25, -.5))
    assert q.q == ((0.0, -0.28125), (-0.25, -0.5))
    q.learn(Transition(1, 0, -1.0, 0))  # .75*-.25 + .25*(-1 + .5*0)
    assert q.q == ((0.0, -0.28125), (-0.4375, -0.5))
    assert q.visits == ((0, 1), (2, 1))


def test_the_goal_is_worth_nothing_even_when_q_began_elsewhere():
    q = learner(alpha=1.0, initial_value=-7.0)
    q.learn(Transition(0, 0, -1.0, None))
    q.learn(Transition(0, 1, -1.0, 1))
    assert q.q == ((-1.0, -8.0), (-7.0, -7.0))


@pytest.mark.parametrize("alpha_visits", [0.0, 20.0])
def test_a_corridor_is_learned_exactly(alpha_visits):
    schedule = TemperatureSchedule(5.0, 0.99, 1.5)
    q = learner(CELLS, alpha_visits=alpha_visits, alpha_floor=0.2, temperature=schedule)
    walk_corridor(q, 1500)
    best = [-(5.0 - cell) for cell in range(5)]
    back = [-1.0 + best[max(0, cell - 1)] for cell in range(5)]
    assert np.array(q.q) == pytest.approx(np.column_stack((best, back)), abs=1e-6)
    assert q.trials_learned == 1500


def test_the_learning_rate_halves_after_the_given_visits_and_keeps_its_floor():
    parameters = QParameters(alpha=0.8, gamma=1.0, temperature=GREEDY, alpha_visits=4.0, alpha_floor=0.1)
    assert [parameters.learning_rate(n) for n in (0, 4, 12)] == [0.8, 0.4, 0.2]
    assert parameters.learning_rate(10**6) == 0.1
    constant = QParameters(alpha=0.3, gamma=1.0, temperature=GREEDY)
    assert constant.learning_rate(0) == constant.learning_rate(10**6) == 0.3


def test_a_frozen_learner_learns_nothing_and_stays_at_the_floor():
    q = learner(frozen=True)
    assert q.temperature == 0.1
    before = q.get_state()
    q.begin_trial(0, np.random.default_rng(0))
    q.learn(Transition(0, 0, -1.0, None))
    assert q.get_state() == before
    assert q.temperature == 0.1
    assert q.trials_learned == 0


def test_trials_count_once_and_only_when_something_was_learned():
    q = learner()
    rng = np.random.default_rng(0)
    for trial, updates in enumerate((2, 0, 1)):
        q.begin_trial(trial, rng)
        for _ in range(updates):
            q.learn(Transition(0, 0, -1.0, None))
    assert q.trials_learned == 2


@given(
    st.lists(st.tuples(st.integers(0, 1), st.integers(0, 1), st.floats(-1e3, -1e-320), st.booleans())),
    st.floats(0.01, 1.0),
)
def test_state_survives_json_to_the_bit_and_learning_goes_on_the_same(steps, alpha):
    q, twin = learner(alpha=alpha, initial_value=-0.0), learner(alpha=alpha)
    q.begin_trial(3, np.random.default_rng(0))
    for state, action, reinforcement, terminal in steps:
        q.learn(Transition(state, action, reinforcement, None if terminal else 1 - state))
    saved = json.loads(json.dumps(q.get_state(), allow_nan=False))
    twin.set_state(saved)
    for learned in (q, twin):
        learned.learn(Transition(0, 1, -0.1, 1))
    assert bits(q.q) == bits(twin.q)
    assert q.get_state() == twin.get_state()


def test_saved_state_does_not_change_with_further_learning():
    q = learner()
    saved = q.get_state()
    q.learn(Transition(0, 0, -1.0, None))
    assert saved["q"] == [[0.0, 0.0], [0.0, 0.0]]
    q.set_state(saved)
    q.learn(Transition(0, 0, -1.0, None))
    assert saved["visits"] == [[0, 0], [0, 0]]


@pytest.mark.parametrize("other", [learner(("a", "b", "c")), learner(actions=EIGHT)])
def test_the_state_of_a_learner_of_another_size_is_refused_and_changes_nothing(other):
    q = learner()
    q.learn(Transition(0, 0, -1.0, None))
    before = q.get_state()
    refuse("learner.q", q.set_state, other.get_state())
    assert q.get_state() == before


@pytest.mark.parametrize(
    ("settings", "field"),
    [
        ({"alpha_floor": 0.6}, "alpha_floor"),
        ({"states": ()}, "states"),
    ],
)
def test_unusable_settings_are_refused(settings, field):
    refuse(f"policy.{field}", learner, **settings)
