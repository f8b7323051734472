import numpy as np
import pytest

from palpate.core.errors import CommandError, ConfigurationError, LifecycleError
from palpate.core.policy.base import (
    Action,
    Decision,
    Observation,
    Policy,
    Transition,
    check_names,
    compass_actions,
    drawing_from,
)


def observation(state: int) -> Observation:
    zero = (0.0, 0.0, 0.0)
    return Observation(state, zero, zero, zero, zero, 0)


@pytest.mark.parametrize("bad", [(-1, 0, -1.0, 0), (0, -1, -1.0, 0), (0, 0, -1.0, -1), (0, 0, -1.0, 0, -1)])
def test_a_negative_index_never_reaches_a_table(bad):
    with pytest.raises(CommandError, match="must not be negative"):
        Transition(*bad)


def test_a_negative_state_cannot_be_observed():
    with pytest.raises(CommandError, match="state"):
        observation(-1)


@pytest.mark.parametrize("reinforcement", [float("nan"), float("-inf")])
def test_a_reinforcement_that_would_poison_the_table_is_refused(reinforcement):
    with pytest.raises(CommandError, match="finite"):
        Transition(0, 0, reinforcement, 1)


def test_a_terminal_transition_has_no_next_state():
    assert Transition(0, 0, -1.0, None).next_state is None


@pytest.mark.parametrize("states", [(), ("a", "a"), ("a", ""), ("a", "two\nlines")])
def test_state_names_are_distinct_and_printable(states):
    with pytest.raises(ConfigurationError) as refused:
        check_names(states, compass_actions(0.001))
    assert refused.value.field == "policy.states"


def test_action_names_are_distinct():
    with pytest.raises(ConfigurationError) as refused:
        check_names(("a",), (Action("go", (1.0, 0.0)), Action("go", (0.0, 1.0))))
    assert refused.value.field == "policy.actions"


def test_choosing_before_a_trial_is_the_callers_fault():
    with pytest.raises(LifecycleError, match=r"begin_trial\(\) first"):
        drawing_from(None, "somebody")
    rng = np.random.default_rng(0)
    assert drawing_from(rng, "somebody") is rng


def test_a_strangers_class_may_just_match_the_protocol():
    class Stranger:
        temperature = None

        def serves(self, state):
            return True

        def begin_trial(self, trial, rng): ...

        def choose(self, observation):
            return Decision(Action("far", (1.0, 1.0)), None, "truth")

        def learn(self, transition): ...

    assert isinstance(Stranger(), Policy)
    assert not isinstance(object(), Policy)
