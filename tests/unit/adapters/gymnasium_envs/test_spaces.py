"""Observations: of the right kind, inside their bounds, and new every time."""

from dataclasses import dataclass
from math import degrees, hypot, inf, nan
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.adapters.config.run import RunConfig
from palpate.adapters.gymnasium_envs.episode import ActionRefusedError
from palpate.adapters.gymnasium_envs.spaces import FreeSteps, NumberedActions, TipWrench, Twists
from palpate.core.policy import ControllerKind, compass_actions


@dataclass
class Sensed:
    """What an observation takes from a task."""

    percept: tuple[int, int] | None = None
    tip_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    wrench_at_tip: Any = ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))


def test_the_raw_observation_is_tip_force_and_torque_in_this_order():
    raw = TipWrench(RunConfig())
    sensed = Sensed(None, (1e-3, -2e-3, 3e-3), ((0.5, -0.25, -4.5), (0.0625, -0.125, 0.03125)))
    seen = raw.of(sensed)
    assert seen.dtype == np.float32
    assert seen == pytest.approx([1e-3, -2e-3, 3e-3, 0.5, -0.25, -4.5, 0.0625, -0.125, 0.03125])
    assert not np.shares_memory(seen, raw.of(sensed))


# Actions: what they mean to the core, and which there are not.


STEPS = compass_actions(0.7e-3)
SHARES = st.floats(-1.0, 1.0, allow_nan=False)


@pytest.mark.parametrize("kind", [int, np.int64, np.int32, np.array, lambda k: np.array([k])])
def test_a_discrete_action_is_the_compass_step_of_that_number(kind):
    actions = NumberedActions(STEPS)
    decisions = [actions.decision(kind(k)) for k in range(8)]
    assert [d.action for d in decisions] == list(STEPS)
    assert [d.index for d in decisions] == list(range(8))
    assert actions.space.n == 8


@pytest.mark.parametrize("action", [-1, 8, 1.0, np.float32(1), nan, "1", None, True, [1, 2], np.array([1, 2])])
def test_a_discrete_action_out_of_range_or_of_another_kind_is_refused(action):
    with pytest.raises(ActionRefusedError, match="must be a whole number from 0 to 7"):
        NumberedActions(STEPS).decision(action)


@given(x=SHARES, y=SHARES)
def test_a_free_step_keeps_its_direction_and_is_never_longer_than_the_longest(x, y):
    decision = FreeSteps(2e-3).decision((x, y))
    dx, dy = decision.action.displacement_m
    assert decision.index is None  # no table may learn from it
    assert hypot(dx, dy) <= 2e-3 * (1 + 1e-12)
    assert dx * y == pytest.approx(dy * x, abs=1e-15)
    if hypot(x, y) <= 1.0:
        assert (dx, dy) == pytest.approx((2e-3 * x, 2e-3 * y), abs=1e-15)
    else:
        assert hypot(dx, dy) == pytest.approx(2e-3)
        assert dx * x >= 0.0 <= dy * y


@pytest.mark.parametrize(
    "action", [(1.0001, 0.0), (0.0, -1.5), (nan, 0.0), (0.0, inf), (0.0,), (0.0, 0.0, 0.0), 3, None, "ab", [[0.0, 1.0]]]
)
def test_a_free_step_out_of_range_or_of_another_shape_is_refused(action):
    with pytest.raises(ActionRefusedError, match="must be two finite numbers from -1 to 1"):
        FreeSteps(1e-3).decision(action)


@pytest.mark.parametrize(
    ("shares", "controller", "rise_m", "step_m"),
    [
        ((1.0, 0.0, -0.5, 0.0, 0.0, 0.0), ControllerKind.LIFT, 1e-3, (2e-3, 0.0)),
        ((0.6, 0.8, 1.0, 0.0, 0.0, 0.0), ControllerKind.STEP, 0.0, (1.2e-3, 1.6e-3)),
    ],
)
def test_a_twist_lifts_or_presses(shares, controller, rise_m, step_m):
    action = Twists(2e-3, 0.1).decision(shares).action
    assert (action.spatial.controller, action.spatial.rise_m) == (controller, rise_m)
    assert action.displacement_m == pytest.approx(step_m)


def test_a_twist_turns_by_no_more_than_the_longest_turn():
    spatial = Twists(2e-3, 0.1).decision((0.0, 0.0, 0.0, 0.5, 0.0, -1.0)).action.spatial
    assert degrees(hypot(*spatial.turn_rad)) == pytest.approx(1.1)
    assert spatial.turn_rad[0] == pytest.approx(-0.5 * spatial.turn_rad[2])
    with pytest.raises(ActionRefusedError, match="must be six finite numbers from -1 to 1"):
        Twists(2e-3, 0.1).decision((0.0, 0.0))
