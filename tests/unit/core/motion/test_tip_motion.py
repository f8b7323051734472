"""The commanded tip: reference and joints stay together, and what the arm did is taken up."""

import numpy as np
import pinocchio as pin
import pytest

from palpate.core.motion import Kinematics, TipMotion, ToolGeometry, arm_named
from palpate.core.ports import PERIOD_S
from palpate.core.ports.values import AppliedCommand, CommandReason, JointVector, Vector3
from palpate.core.trial import goal_in_base
from palpate.core.trial.config import GoalConfig
from tests.unit.core.fake_world import ready_pose

ARMS = ("zebra-zero", "ur5")
STILL: Vector3 = (0.0, 0.0, 0.0)


class Bench:
    def __init__(self, name: str) -> None:
        self.look = Kinematics(arm_named(name), ToolGeometry())
        self.task = goal_in_base(GoalConfig())
        self.home, rotation = ready_pose(name)
        self.rotation = np.array(rotation)
        self.motion = TipMotion(Kinematics(arm_named(name), ToolGeometry()), self.task, self.rotation, PERIOD_S)
        self.motion.start(self.home)

    def tip_m(self, q: JointVector) -> list[float]:
        self.look.update(q)
        tip: list[float] = self.task.actInv(self.look.tip_in_base).translation.tolist()
        return tip


@pytest.fixture(params=ARMS)
def bench(request: pytest.FixtureRequest) -> Bench:
    return Bench(request.param)


def test_it_takes_over_where_the_arm_is(bench: Bench) -> None:
    assert bench.motion.reference_m == pytest.approx((0.0, 0.0, -3e-3), abs=2e-6)
    assert bench.motion.reference_m == pytest.approx(bench.tip_m(bench.home), abs=1e-15)


def test_without_velocity_it_holds_still(bench: Bench) -> None:
    before = bench.motion.reference_m
    for _ in range(100):
        command = bench.motion.move(STILL)
    assert bench.motion.reference_m == before
    np.testing.assert_allclose(command.position_rad, bench.home, atol=1e-12)


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_the_tip_goes_where_the_velocity_points_in_the_task_frame(bench: Bench, axis: int) -> None:
    start = np.array(bench.motion.reference_m)
    velocity = [0.0, 0.0, 0.0]
    velocity[axis] = 14e-3  # 0.1 mm a tick
    for _ in range(20):
        command = bench.motion.move((velocity[0], velocity[1], velocity[2]))
    expected = start.copy()
    expected[axis] += 2e-3
    np.testing.assert_allclose(bench.motion.reference_m, expected, atol=1e-15)
    np.testing.assert_allclose(bench.tip_m(command.position_rad), expected, atol=1e-7)


def test_the_tool_keeps_its_orientation(bench: Bench) -> None:
    rng = np.random.default_rng(2)
    for _ in range(200):
        x, y, z = rng.uniform(-0.02, 0.02, 3).tolist()
        command = bench.motion.move((x, y, z))
    bench.look.update(command.position_rad)
    assert np.linalg.norm(pin.log3(bench.rotation.T @ bench.look.tip_rotation)) < 1e-6


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


def test_a_command_that_was_applied_as_asked_changes_nothing(bench: Bench) -> None:
    other = Bench(bench.look.arm.name)
    for motion in (bench.motion, other.motion):
        motion.move((0.02, 0.0, 0.0))
    bench.motion.adopt(AppliedCommand(bench.home))
    assert bench.motion.move(STILL) == other.motion.move(STILL)


def test_a_stopped_arm_does_not_wind_the_joints_up(bench: Bench) -> None:
    reach = bench.look.velocity_limit_rad_s * PERIOD_S * (1 + 1e-9)
    for _ in range(500):
        command = bench.motion.move((0.0, 0.0, -0.1))
        assert (np.abs(np.array(command.position_rad) - bench.home) <= reach).all()
        bench.motion.adopt(AppliedCommand(bench.home, CommandReason.STOPPED))


def test_the_tool_turns_about_the_tip_no_faster_than_it_may(bench: Bench) -> None:
    tip_m = bench.motion.reference_m
    for _ in range(35):
        bench.motion.turn((9.0, 0.0, 0.0))
        q = bench.motion.move(STILL).position_rad
    assert bench.motion.turn_rad == pytest.approx((np.radians(5.0), 0.0, 0.0))
    for _ in range(5):
        # A rate is for one tick only.
        q = bench.motion.move(STILL).position_rad
    assert bench.tip_m(q) == pytest.approx(tip_m, abs=1e-9)
    turned = bench.task.rotation.T @ bench.look.tip_rotation @ bench.rotation.T @ bench.task.rotation
    np.testing.assert_allclose(turned, pin.exp3(np.array([np.radians(5.0), 0.0, 0.0])), atol=1e-9)
    bench.motion.start(bench.home)
    assert bench.motion.turn_rad == (0.0, 0.0, 0.0)
