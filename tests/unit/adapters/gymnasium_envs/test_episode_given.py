"""The policy of an environment hands out what it was given, once."""

from __future__ import annotations

import numpy as np
import pytest

from palpate.adapters.gymnasium_envs.episode import GivenActions
from palpate.core.errors import LifecycleError
from palpate.core.policy import Decision, Observation, Policy, Transition, compass_actions

NOWHERE = (0.0, 0.0, 0.0)
SEEN = Observation(0, NOWHERE, NOWHERE, NOWHERE, NOWHERE, 0)
EAST = Decision(compass_actions(1e-3)[0], 0, "environment")


def test_it_chooses_what_it_was_given_and_only_once() -> None:
    policy = GivenActions()
    assert isinstance(policy, Policy)
    assert policy.temperature is None
    assert policy.serves(99)
    policy.give(EAST)
    assert policy.choose(SEEN) is EAST
    policy.learn(Transition(0, 0, -1.0, None))
    with pytest.raises(LifecycleError, match="none is given"):
        policy.choose(SEEN)


def test_a_new_trial_forgets_what_was_given() -> None:
    policy = GivenActions()
    policy.give(EAST)
    policy.begin_trial(1, np.random.default_rng(0))
    with pytest.raises(LifecycleError):
        policy.choose(SEEN)
