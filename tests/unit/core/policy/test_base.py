from math import cos, hypot, inf, nan, radians, sin

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.core.errors import CommandError, ConfigurationError, LifecycleError
from palpate.core.policy.base import Action, Transition, check_names, compass_actions, drawing_from
from tests.unit.core.policy.bench import observation, refuse

# Transitions and names.


@pytest.mark.parametrize("bad", [(-1, 0, -1.0, 0), (0, -1, -1.0, 0), (0, 0, -1.0, -1), (0, 0, -1.0, 0, -1)])
def test_a_negative_index_never_reaches_a_table(bad):
    with pytest.raises(CommandError, match="must not be negative"):
        Transition(*bad)


def test_a_negative_state_cannot_be_observed():
    with pytest.raises(CommandError, match="state"):
        observation(-1)


@pytest.mark.parametrize("reinforcement", [nan, -inf])
def test_a_reinforcement_that_would_poison_the_table_is_refused(reinforcement):
    with pytest.raises(CommandError, match="finite"):
        Transition(0, 0, reinforcement, 1)


@pytest.mark.parametrize("states", [(), ("a", "a"), ("a", ""), ("a", "two\nlines")])
def test_state_names_are_distinct_and_printable(states):
    refuse("policy.states", check_names, states, compass_actions(0.001))


def test_action_names_are_distinct():
    refuse("policy.actions", check_names, ("a",), (Action("go", (1.0, 0.0)), Action("go", (0.0, 1.0))))


def test_choosing_before_a_trial_is_the_callers_fault():
    with pytest.raises(LifecycleError, match=r"begin_trial\(\) first"):
        drawing_from(None, "somebody")
    rng = np.random.default_rng(0)
    assert drawing_from(rng, "somebody") is rng


# Actions.


def test_axis_steps_are_exact_and_opposite_steps_cancel_to_the_bit():
    actions = {a.name: a.displacement_m for a in compass_actions(0.001)}
    assert actions["+x"] == (0.001, 0.0)
    assert actions["-y"] == (0.0, -0.001)
    assert actions["+x+y"][0] == actions["+x+y"][1]
    for name, (x, y) in actions.items():
        opposite = actions[name.translate(str.maketrans("+-", "-+"))]
        assert (x + opposite[0], y + opposite[1]) == (0.0, 0.0)
        assert not {repr(x), repr(y)} & {"-0.0"}


@given(st.floats(1e-5, 0.1), st.integers(2, 72))
def test_directions_are_equally_spaced_and_equally_long(step_m, directions):
    actions = compass_actions(step_m, directions)
    assert len({a.name for a in actions}) == directions
    for k, action in enumerate(actions):
        angle = radians(360.0 * k / directions)
        assert hypot(*action.displacement_m) == pytest.approx(step_m, rel=1e-12)
        wanted = (step_m * cos(angle), step_m * sin(angle))
        assert action.displacement_m == pytest.approx(wanted, abs=1e-14)


@pytest.mark.parametrize("step_m", [0.0, -1.0, nan, inf])
def test_unusable_settings_are_refused(step_m):
    refuse("actions.step_m", compass_actions, step_m)
    refuse("actions.directions", compass_actions, 0.001, 1)


def test_an_action_must_be_finite():
    with pytest.raises(ConfigurationError, match="finite"):
        Action("nowhere", (0.0, nan))
