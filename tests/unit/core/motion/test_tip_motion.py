"""The commanded tip: reference and joints stay together, and what the arm did is taken up."""

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.core.motion import FASTEST_TURN_RAD_S, GivingWay, Kinematics, TipMotion, arm_named, orientation, turn_of
from palpate.core.motion.tip_motion import FASTEST_JOINT_RAD_S
from palpate.core.ports import PERIOD_S, AppliedCommand, CommandReason, JointVector, Vector3
from palpate.core.trial import GoalConfig, goal_in_base
from tests.support.tool import TOOL
from tests.unit.core.fake_world import ready_pose

ARMS = ("zebra-zero", "ur5")
STILL: Vector3 = (0.0, 0.0, 0.0)


class Bench:
    def __init__(self, name: str) -> None:
        self.look = Kinematics(arm_named(name), TOOL)
        self.task = goal_in_base(GoalConfig())
        self.home, rotation = ready_pose(name)
        self.rotation = np.array(rotation)
        self.motion = TipMotion(Kinematics(arm_named(name), TOOL), self.task, self.rotation, PERIOD_S)
        self.motion.start(self.home)

    def tip_m(self, q: JointVector) -> list[float]:
        self.look.update(q)
        tip: list[float] = self.task.actInv(self.look.tip_in_base).translation.tolist()
        return tip


@pytest.fixture(params=ARMS)
def bench(request: pytest.FixtureRequest) -> Bench:
    return Bench(request.param)


def test_a_command_that_was_changed_is_taken_up(bench: Bench) -> None:
    first = bench.motion.move((0.02, 0.0, 0.0))
    for _ in range(30):
        asked = bench.motion.move((0.02, 0.0, 0.0))
    bench.motion.adopt(AppliedCommand(first.position_rad, CommandReason.VELOCITY_LIMIT))
    # The next step starts where the arm really is, no longer than the arm is quick, and goes to the reference.
    reach = bench.look.velocity_limit_rad_s * PERIOD_S * (1 + 1e-9)
    again = bench.motion.move(STILL)
    assert (np.abs(np.array(again.position_rad) - first.position_rad) <= reach).all()
    assert np.abs(np.array(again.position_rad) - asked.position_rad).max() > 1e-5
    for _ in range(20):
        again = bench.motion.move(STILL)
    np.testing.assert_allclose(again.position_rad, asked.position_rad, atol=1e-7)


def test_a_tool_that_was_left_turned_stays_so_until_it_is_righted(bench: Bench) -> None:
    turned = bench.home
    for _ in range(21):
        bench.motion.turn((0.1, -0.05, 0.35))
        turned = bench.motion.move(STILL).position_rad
    bench.motion.start(turned)
    np.testing.assert_allclose(bench.motion.move(STILL).position_rad, turned, atol=1e-9)
    righted = turned
    for _ in range(200):
        bench.motion.right(0.1)
        righted = bench.motion.move(STILL).position_rad
    assert bench.motion.turn_rad == STILL
    bench.look.update(righted)
    np.testing.assert_allclose(bench.look.tip_rotation, bench.rotation, atol=1e-9)


def test_a_stopped_arm_does_not_wind_the_joints_up(bench: Bench) -> None:
    reach = bench.look.velocity_limit_rad_s * PERIOD_S * (1 + 1e-9)
    for _ in range(500):
        command = bench.motion.move((0.0, 0.0, -0.1))
        assert (np.abs(np.array(command.position_rad) - bench.home) <= reach).all()
        bench.motion.adopt(AppliedCommand(bench.home, CommandReason.STOPPED))


def test_the_tool_turns_about_the_tip_no_faster_than_it_may(bench: Bench) -> None:
    tip_m = bench.motion.reference_m
    turned_rad = 35 * PERIOD_S * bench.motion.fastest_turn_rad_s((9.0, 0.0, 0.0))
    for _ in range(35):
        bench.motion.turn((9.0, 0.0, 0.0))
        q = bench.motion.move(STILL).position_rad
    assert bench.motion.turn_rad == pytest.approx((turned_rad, 0.0, 0.0))
    for _ in range(5):
        # A rate is for one tick only.
        q = bench.motion.move(STILL).position_rad
    assert bench.tip_m(q) == pytest.approx(tip_m, abs=1e-9)
    turned = bench.task.rotation.T @ bench.look.tip_rotation @ bench.rotation.T @ bench.task.rotation
    np.testing.assert_allclose(turned, pin.exp3(np.array([turned_rad, 0.0, 0.0])), atol=1e-9)
    bench.motion.start(bench.home)
    assert bench.motion.turn_rad == (0.0, 0.0, 0.0)


@pytest.mark.parametrize("name", ["zebra-zero", "panda", "ur5", "xarm7"])
@pytest.mark.parametrize("axis", [(1.0, 0.0, 0.0), (0.0, -1.0, 0.0), (0.6, 0.8, 0.0), (0.0, 0.0, 1.0)])
def test_no_joint_is_faster_in_a_turn_than_a_late_arm_can_follow(name: str, axis: Vector3) -> None:
    bench = Bench(name)
    for _ in range(14):
        before = np.array(bench.motion.move(STILL).position_rad)
        bench.motion.turn(axis)
        rates = np.abs(np.array(bench.motion.move(STILL).position_rad) - before) / PERIOD_S
        bench.motion.look_at_joints()
        assert rates.max() <= FASTEST_JOINT_RAD_S * 1.03
    asked = bench.motion.fastest_turn_rad_s(axis)
    assert rates.max() == pytest.approx(FASTEST_JOINT_RAD_S, rel=0.03) or asked == FASTEST_TURN_RAD_S


def test_a_wrist_near_a_singularity_turns_more_slowly() -> None:
    slowest = {name: Bench(name).motion.fastest_turn_rad_s((1.0, 0.0, 0.0)) for name in ("panda", "ur10")}
    assert slowest["panda"] < 0.5 * slowest["ur10"] == 0.5 * FASTEST_TURN_RAD_S


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
