import numpy as np
import pytest
from scipy.stats import chisquare

from palpate.core.errors import ConfigurationError, LifecycleError
from palpate.core.policy.base import Observation, Transition, compass_actions
from palpate.core.policy.programmed import RandomWalkPolicy

ZERO = (0.0, 0.0, 0.0)
SOMEWHERE = Observation(3, ZERO, ZERO, ZERO, ZERO, 0)


def test_every_action_is_as_likely_and_costs_one_number():
    policy, rng, twin = (
        RandomWalkPolicy(compass_actions(0.001)),
        np.random.default_rng(4),
        np.random.default_rng(4),
    )
    policy.begin_trial(0, rng)
    decisions = [policy.choose(SOMEWHERE) for _ in range(8000)]
    twin.random(8000)
    assert rng.bit_generator.state == twin.bit_generator.state
    assert chisquare(np.bincount([d.index for d in decisions], minlength=8)).pvalue > 0.01
    assert all(d.action is policy.actions[d.index] and d.source == "random" for d in decisions)


def test_what_happens_does_not_change_it():
    walks = []
    for reinforcement in (-1.0, -1e6):
        policy = RandomWalkPolicy(compass_actions(0.001))
        policy.begin_trial(0, np.random.default_rng(9))
        policy.learn(Transition(0, 0, reinforcement, None))
        walks.append([policy.choose(SOMEWHERE).index for _ in range(20)])
    assert walks[0] == walks[1]
    assert policy.serves(10**6)
    assert policy.temperature is None


def test_it_needs_actions_and_a_trial():
    with pytest.raises(ConfigurationError):
        RandomWalkPolicy(())
    with pytest.raises(LifecycleError):
        RandomWalkPolicy(compass_actions(0.001)).choose(SOMEWHERE)
