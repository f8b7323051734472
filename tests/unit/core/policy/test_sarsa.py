import json

import numpy as np
import pytest

from palpate.core.errors import LifecycleError
from palpate.core.policy import MixedPolicy, ProgrammedPolicy, Sarsa, SarsaParameters, TemperatureSchedule, Transition
from tests.unit.core.policy.bench import GREEDY, TWO, observation

STATES = ("i", "j", "k")


def learner(frozen: bool = False, states: tuple[str, ...] = STATES, **settings) -> Sarsa:
    settings = {"alpha": 0.5, "gamma": 1.0, "temperature": GREEDY, "trace_decay": 0.5} | settings
    sarsa = Sarsa(states, TWO, SarsaParameters(**settings), frozen=frozen)
    sarsa.begin_trial(0, np.random.default_rng(0))
    return sarsa


def bound(state: int, action: int, after: int | None, then: int | None, earned: float = -1.0) -> Transition:
    """A transition whose next action is known, so that nothing is drawn."""
    return Transition(state, action, earned, after, then)


def test_updates_have_the_hand_computed_values() -> None:
    q = learner()
    q.learn(bound(0, 1, 1, 0))  # delta -1: Q(0,1) = -.5
    assert q.q == ((0.0, -0.5), (0.0, 0.0), (0.0, 0.0))
    q.learn(bound(1, 0, 2, 1))  # delta -1: Q(1,0) = -.5, and half of it for what led here
    assert q.q == ((0.0, -0.75), (-0.5, 0.0), (0.0, 0.0))
    q.learn(bound(2, 1, None, None, -4.0))  # delta -4, traces 1, 1/2, 1/4
    assert q.q == ((0.0, -1.25), (-1.5, 0.0), (0.0, -2.0))
    assert q.visits == ((0, 1), (1, 0), (0, 1))
    assert q.trials_learned == 1


def test_traces_replace_and_another_action_ends_them() -> None:
    q = learner(alpha=1.0, trace_decay=1.0)
    q.learn(bound(0, 0, 0, 0, 0.0))
    q.learn(bound(0, 0, 0, 1, 0.0))  # again: the trace is 1, not 2
    q.learn(bound(0, 1, 1, 0, 0.0))  # the other action: the trace of the first is gone
    q.learn(bound(1, 0, None, None, -1.0))
    assert q.q == ((0.0, -1.0), (-1.0, 0.0), (0.0, 0.0))


def test_a_new_trial_forgets_what_led_where() -> None:
    q = learner(alpha=1.0, trace_decay=1.0)
    q.learn(bound(0, 0, 1, 0, 0.0))
    q.begin_trial(1, np.random.default_rng(0))
    q.learn(bound(1, 0, None, None))
    assert q.q[0] == (0.0, 0.0)
    assert q.trials_learned == 2


def test_the_action_that_was_learned_with_is_the_one_that_is_taken() -> None:
    q = learner(temperature=TemperatureSchedule(1.0, 1.0, 1.0), alpha=1.0, trace_decay=0.0, initial_value=-1.0)
    q.learn(bound(1, 0, None, None, -2.0))
    q.learn(bound(1, 1, None, None, -3.0))
    for _ in range(20):
        q.learn(Transition(0, 0, 0.0, 1))
        taken = q.choose(observation(1)).index
        assert q.q[0][0] == {0: -2.0, 1: -3.0}[taken]


def test_an_action_drawn_for_another_state_is_not_taken() -> None:
    q = learner(alpha=1.0)
    q.learn(bound(2, 0, None, None, -2.0))
    q.learn(bound(1, 1, None, None, -2.0))
    q.learn(Transition(0, 0, -1.0, 1))
    assert q.choose(observation(2)).index == 1
    assert q.choose(observation(1)).index == 0


def test_where_another_policy_acts_its_action_counts() -> None:
    sarsa = learner(alpha=1.0, trace_decay=0.0)
    policy = MixedPolicy(STATES, [ProgrammedPolicy(STATES, TWO, {"j": TWO[1].name}), sarsa])
    policy.begin_trial(0, np.random.default_rng(0))
    policy.learn(Transition(1, 1, -7.0, None))
    policy.learn(Transition(0, 0, -1.0, 1))
    assert sarsa.q[0][0] == -8.0
    assert policy.choose(observation(1)).source == "programmed"


def test_a_frozen_learner_learns_nothing_and_draws_when_asked() -> None:
    q = learner(frozen=True, temperature=TemperatureSchedule(1.0, 1.0, 0.5))
    before = q.get_state()
    q.learn(Transition(0, 0, -1.0, 1))
    assert q.get_state() == before
    assert q.temperature == 0.5


def test_it_goes_on_where_its_state_was_kept_even_within_a_trial() -> None:
    first, second = learner(temperature=TemperatureSchedule(1.0, 1.0, 1.0)), learner()
    first.learn(Transition(0, 0, -1.0, 1))
    first.learn(Transition(1, 1, -1.0, 2))
    second.set_state(json.loads(json.dumps(first.get_state())))
    assert second.get_state() == first.get_state()
    assert second.choose(observation(2)) == first.choose(observation(2))
    for q in (first, second):
        q.learn(bound(2, 0, None, None))
    assert first.q == second.q


def test_the_next_action_needs_a_trial() -> None:
    sarsa = Sarsa(STATES, TWO, SarsaParameters(alpha=0.5, gamma=1.0, temperature=GREEDY))
    with pytest.raises(LifecycleError):
        sarsa.learn(Transition(0, 0, -1.0, 1))
