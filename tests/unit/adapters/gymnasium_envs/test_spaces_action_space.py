"""Actions: what they mean to the core, and which there are not."""

from __future__ import annotations

from math import hypot, inf, nan
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.adapters.gymnasium_envs.episode import ActionRefusedError
from palpate.adapters.gymnasium_envs.spaces import CompassSteps, FreeSteps
from palpate.core.policy import compass_actions

STEPS = compass_actions(0.7e-3)
SHARES = st.floats(-1.0, 1.0, allow_nan=False)


@pytest.mark.parametrize("kind", [int, np.int64, np.int32, np.array, lambda k: np.array([k])])
def test_a_discrete_action_is_the_compass_step_of_that_number(kind: Any) -> None:
    actions = CompassSteps(STEPS)
    decisions = [actions.decision(kind(k)) for k in range(8)]
    assert [d.action for d in decisions] == list(STEPS)
    assert [d.index for d in decisions] == list(range(8))
    assert actions.space.n == 8


@pytest.mark.parametrize("action", [-1, 8, 1.0, np.float32(1), nan, "1", None, True, [1], np.array([1, 2])])
def test_a_discrete_action_out_of_range_or_of_another_kind_is_refused(action: Any) -> None:
    with pytest.raises(ActionRefusedError, match="is refused: a whole number from 0 to 7"):
        CompassSteps(STEPS).decision(action)


@given(x=SHARES, y=SHARES)
def test_a_free_step_keeps_its_direction_and_is_never_longer_than_the_longest(x: float, y: float) -> None:
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


def test_every_corner_of_the_box_is_an_action() -> None:
    actions = FreeSteps(1e-3)
    for corner in ((-1, -1), (-1, 1), (1, -1), (1, 1), (0, 0)):
        action = np.array(corner, np.float32)
        assert actions.space.contains(action)
        assert actions.decision(action).action.name


@pytest.mark.parametrize(
    "action", [(1.0001, 0.0), (0.0, -1.5), (nan, 0.0), (0.0, inf), (0.0,), (0.0, 0.0, 0.0), 3, None, "ab", [[0.0, 1.0]]]
)
def test_a_free_step_out_of_range_or_of_another_shape_is_refused(action: Any) -> None:
    with pytest.raises(ActionRefusedError, match="is refused: two finite numbers from -1 to 1"):
        FreeSteps(1e-3).decision(action)
