import numpy as np
import pytest

from palpate.core.errors import ConfigurationError
from palpate.core.policy.base import Observation, Transition, compass_actions
from palpate.core.policy.programmed import AssignedPolicy, check_known

EIGHT = compass_actions(0.001)


def observation(state: int) -> Observation:
    zero = (0.0, 0.0, 0.0)
    return Observation(state, zero, zero, zero, zero, 0)


def test_it_takes_the_assigned_action_and_says_whose_it_is():
    policy = AssignedPolicy(("a", "b"), EIGHT, (6, None), "examples")
    decision = policy.choose(observation(0))
    assert (decision.action.name, decision.index, decision.source) == ("-y", 6, "examples")


def test_it_serves_only_the_states_that_have_an_action():
    policy = AssignedPolicy(("a", "b"), EIGHT, (0, None), "programmed")
    assert [policy.serves(0), policy.serves(1)] == [True, False]
    assert [policy.assigned(0), policy.assigned(1)] == [0, None]
    with pytest.raises(ConfigurationError, match=r"policy\.programmed = 'b' is refused.*mixed policy"):
        policy.choose(observation(1))


def test_it_is_fixed_and_draws_nothing():
    policy = AssignedPolicy(("a",), EIGHT, (2,), "programmed")
    rng = np.random.default_rng(0)
    before = rng.bit_generator.state
    policy.begin_trial(0, rng)
    for reinforcement in (-1.0, -100.0):
        assert policy.choose(observation(0)).index == 2
        policy.learn(Transition(0, 2, reinforcement, 0))
    assert rng.bit_generator.state == before
    assert policy.temperature is None


def test_unknown_names_are_refused_with_all_that_is_accepted():
    with pytest.raises(ConfigurationError, match=r"here = 'c' is refused: a state of this task: a, b"):
        check_known("here", "c", "+x", ("a", "b"), EIGHT)
    with pytest.raises(ConfigurationError, match=r"here = 'up' is refused: .*'a'.*\+x, \+x\+y, \+y"):
        check_known("here", "a", "up", ("a", "b"), EIGHT)
    check_known("here", "a", "+x", ("a", "b"), EIGHT)
