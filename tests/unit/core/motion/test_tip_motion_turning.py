"""Orientation from lean and yaw, and a tool that gives way to torque."""

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.core.motion import GivingWay, orientation, turn_of
from palpate.core.ports import Vector3

angles = st.tuples(*[st.floats(-0.5, 0.5)] * 3)


@given(angles)
def test_the_tool_is_turned_by_its_yaw_first_and_leans_then(turn: Vector3) -> None:
    wanted = pin.exp3(np.array([turn[0], turn[1], 0.0])) @ pin.exp3(np.array([0.0, 0.0, turn[2]]))
    np.testing.assert_allclose(orientation(turn), wanted, atol=1e-12)


@given(angles)
def test_lean_and_yaw_are_told_from_the_orientation(turn: Vector3) -> None:
    np.testing.assert_allclose(turn_of(orientation(turn)), turn, atol=1e-9)


def test_it_gives_way_with_the_torque_and_no_faster_than_it_may() -> None:
    giving = GivingWay(0.4, 0.2, 0.1)
    assert giving.rate_rad_s((0.1, -0.05, 0.1)) == pytest.approx((0.04, -0.02, 0.02))
    assert np.linalg.norm(giving.rate_rad_s((9.0, 9.0, 9.0))) == pytest.approx(0.1)
