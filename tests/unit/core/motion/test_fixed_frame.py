"""A frame in plain floats, held against Pinocchio."""

import numpy as np
import pinocchio as pin
import pytest

from palpate.adapters.config import scenario
from palpate.core.motion import FixedFrame, rotated
from palpate.core.trial import goal_in_base

rng = np.random.default_rng(3)


def test_agrees_with_pinocchio() -> None:
    placement, place = pin.SE3.Random(), rng.normal(size=3)
    frame, xyz = FixedFrame(placement), tuple(place.tolist())
    assert frame.place_m(xyz) == pytest.approx(placement.actInv(place))
    assert frame.place_in_base_m(xyz) == pytest.approx(placement.act(place))
    assert frame.vector(xyz) == pytest.approx(placement.rotation.T @ place)
    assert rotated(placement.rotation.tolist(), xyz) == pytest.approx(placement.rotation @ place)


def test_equals_it_to_the_bit_in_the_task_frame() -> None:
    goal = goal_in_base(scenario("paper").task.goal)
    frame = FixedFrame(goal)
    for place in rng.normal(size=(100, 3)):
        assert np.array(frame.place_m(place.tolist())).tobytes() == goal.actInv(place).tobytes()
        assert np.array(frame.place_in_base_m(place.tolist())).tobytes() == goal.act(place).tobytes()
