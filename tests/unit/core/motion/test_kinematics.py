"""Kinematics against tables and spatial algebra, and the commanded tip."""

from dataclasses import replace
from math import cos, pi, sin

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.core.errors import AssetError
from palpate.core.motion import FASTEST_TURN_RAD_S, AngularCompliance, TipMotion, ToolGeometry, orientation, turn_of
from palpate.core.motion.arm import ARMS, arm_named
from palpate.core.motion.model import Kinematics, wrench_about
from palpate.core.motion.tip_motion import FASTEST_JOINT_RAD_S
from palpate.core.ports import PERIOD_S, AppliedCommand, CommandReason
from palpate.core.trial import GoalConfig, goal_in_base
from palpate.simulation.emulators.ur.kinematics import LENGTHS_M
from tests.support.tool import TOOL
from tests.unit.core.fake_world import ready_pose

ZEBRA = arm_named("zebra-zero")
NO_TOOL = ToolGeometry()
arms = pytest.mark.parametrize("arm", ARMS.values(), ids=ARMS.keys())


# Standard Denavit-Hartenberg: offset of theta [rad], d [m], a [m], alpha [rad] (reference/hardware.md, 2.3).
ZEBRA_DH = (
    (0.0, 0.285, 0.0, -pi / 2),
    (-pi / 2, 0.0, 0.300, pi),
    (-pi / 2, 0.0, 0.0, -pi / 2),
    (0.0, 0.2375, 0.0, -pi / 2),
    (0.0, 0.0, 0.0, pi / 2),
    (0.0, 0.040, 0.0, 0.0),
)


def flange_by_table(q, table=ZEBRA_DH):
    """Homogeneous transform of the flange, (4, 4), from a DH table alone."""
    placement = np.eye(4)
    for angle, (offset, d, a, alpha) in zip(q, table, strict=True):
        c, s, ca, sa = cos(angle + offset), sin(angle + offset), cos(alpha), sin(alpha)
        placement = placement @ np.array(
            [[c, -s * ca, s * sa, a * c], [s, c * ca, -c * sa, a * s], [0, sa, ca, d], [0, 0, 0, 1]]
        )
    return placement


def random_angles(kinematics, count):
    rng = np.random.default_rng(7)
    return rng.uniform(kinematics.lower_rad, kinematics.upper_rad, (count, kinematics.joints))


components = st.floats(-1e3, 1e3)
vectors = st.tuples(components, components, components)


class TestKinematics:
    def test_zebra_zero_follows_its_table_everywhere(self):
        kinematics = Kinematics(ZEBRA, NO_TOOL)
        for q in random_angles(kinematics, 300):
            kinematics.update(q)
            expected = flange_by_table(q)
            np.testing.assert_allclose(kinematics.tip_position_m, expected[:3, 3], atol=1e-12)
            np.testing.assert_allclose(kinematics.tip_rotation, expected[:3, :3], atol=1e-12)

    @pytest.mark.parametrize("name", ["ur3e", "ur5e", "ur10e", "ur16e", "ur20"])
    def test_arms_of_universal_robots_follow_their_published_table_everywhere(self, name):
        a2, a3, d1, d4, d5, d6 = LENGTHS_M[name]
        table = (
            (0.0, d1, 0.0, pi / 2), (0.0, 0.0, a2, 0.0), (0.0, 0.0, a3, 0.0),
            (0.0, d4, 0.0, pi / 2), (0.0, d5, 0.0, -pi / 2), (0.0, d6, 0.0, 0.0),
        )  # fmt: skip
        kinematics = Kinematics(arm_named(name), NO_TOOL)
        turned = np.diag([-1.0, -1.0, 1.0, 1.0])  # from the controller's Base to ROS's base_link
        for q in random_angles(kinematics, 100):
            kinematics.update(q)
            expected = turned @ flange_by_table(q, table)
            np.testing.assert_allclose(kinematics.tip_position_m, expected[:3, 3], atol=1e-9)
            np.testing.assert_allclose(kinematics.tip_rotation, expected[:3, :3], atol=1e-9)

    def test_tool_sits_on_the_flange_along_its_axis(self):
        tool = TOOL  # sensor 0.03 m beyond the flange, tip 0.14 m beyond that
        kinematics, bare = Kinematics(ZEBRA, tool), Kinematics(ZEBRA, NO_TOOL)
        for q in random_angles(kinematics, 20):
            kinematics.update(q)
            bare.update(q)
            axis = bare.tip_rotation[:, 2]
            np.testing.assert_allclose(kinematics.tip_position_m, bare.tip_position_m + 0.17 * axis, atol=1e-14)
            np.testing.assert_allclose(kinematics.tip_rotation, bare.tip_rotation, atol=1e-14)
            sensor = kinematics.sensor_in_base
            np.testing.assert_allclose(sensor.translation, bare.tip_position_m + 0.03 * axis, atol=1e-14)
            np.testing.assert_allclose(sensor.rotation, bare.tip_rotation, atol=1e-14)

    @arms
    def test_jacobian_is_the_derivative_of_the_tip(self, arm):
        kinematics, step = Kinematics(arm, TOOL), 1e-6
        for q in random_angles(kinematics, 25):
            jacobian = kinematics.tip_jacobian(q)
            assert jacobian.shape == (6, kinematics.joints)
            for joint in range(kinematics.joints):
                placements = []
                for side in (-step, step):
                    moved = q.copy()
                    moved[joint] += side
                    kinematics.update(moved)
                    placements.append(kinematics.tip_in_base)
                slope = pin.log6(placements[0].actInv(placements[1])).vector / (2 * step)
                np.testing.assert_allclose(jacobian[:, joint], slope, atol=2e-9)

    @given(force=vectors, torque=vectors, point=vectors)
    def test_wrench_transport_is_that_of_spatial_algebra(self, force, torque, point):
        shift = pin.SE3(np.eye(3), np.array(point))
        expected = shift.actInv(pin.Force(np.array(force), np.array(torque)))
        np.testing.assert_allclose(wrench_about(force, torque, point), expected.angular, rtol=1e-12, atol=1e-9)

    @pytest.mark.parametrize("content", [None, "", "not a URDF", "<model/>"])
    def test_urdf_that_cannot_be_read_is_an_asset_error(self, tmp_path, content):
        path = tmp_path / "arm.urdf"
        if content is not None:
            path.write_text(content)
        with pytest.raises(AssetError, match="no readable URDF") as caught:
            Kinematics(replace(ZEBRA, urdf=str(path)), TOOL)
        assert (caught.value.field, caught.value.value) == ("arm", str(path))
        assert "\n" not in str(caught.value)


TWO_ARMS = ("zebra-zero", "ur5")
STILL = (0.0, 0.0, 0.0)


class Bench:
    def __init__(self, name):
        self.look = Kinematics(arm_named(name), TOOL)
        self.task = goal_in_base(GoalConfig())
        self.home, rotation = ready_pose(name)
        self.rotation = np.array(rotation)
        self.motion = TipMotion(Kinematics(arm_named(name), TOOL), self.task, self.rotation, PERIOD_S)
        self.motion.start(self.home)

    def tip_m(self, q):
        self.look.update(q)
        return self.task.actInv(self.look.tip_in_base).translation.tolist()


@pytest.fixture(params=TWO_ARMS)
def bench(request):
    return Bench(request.param)


angles = st.tuples(*[st.floats(-0.5, 0.5)] * 3)


class TestTipMotion:
    def test_command_that_was_changed_is_taken_up(self, bench):
        first = bench.motion.move((0.02, 0.0, 0.0))
        for _ in range(30):
            requested = bench.motion.move((0.02, 0.0, 0.0))
        bench.motion.adopt(AppliedCommand(first.position_rad, CommandReason.VELOCITY_LIMIT))
        # The next step starts where the arm really is, no longer than the arm is quick, and goes to the reference.
        reach = bench.look.velocity_limit_rad_s * PERIOD_S * (1 + 1e-9)
        again = bench.motion.move(STILL)
        assert (np.abs(np.array(again.position_rad) - first.position_rad) <= reach).all()
        assert np.abs(np.array(again.position_rad) - requested.position_rad).max() > 1e-5
        for _ in range(20):
            again = bench.motion.move(STILL)
        np.testing.assert_allclose(again.position_rad, requested.position_rad, atol=1e-7)

    def test_tool_that_was_left_turned_stays_so_until_it_is_righted(self, bench):
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

    def test_stopped_arm_does_not_wind_the_joints_up(self, bench):
        reach = bench.look.velocity_limit_rad_s * PERIOD_S * (1 + 1e-9)
        for _ in range(500):
            command = bench.motion.move((0.0, 0.0, -0.1))
            assert (np.abs(np.array(command.position_rad) - bench.home) <= reach).all()
            bench.motion.adopt(AppliedCommand(bench.home, CommandReason.STOPPED))

    def test_tool_turns_about_the_tip_no_faster_than_it_may(self, bench):
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
    def test_no_joint_is_faster_in_a_turn_than_a_late_arm_can_follow(self, name, axis):
        bench = Bench(name)
        for _ in range(14):
            before = np.array(bench.motion.move(STILL).position_rad)
            bench.motion.turn(axis)
            rates = np.abs(np.array(bench.motion.move(STILL).position_rad) - before) / PERIOD_S
            bench.motion.look_at_joints()
            assert rates.max() <= FASTEST_JOINT_RAD_S * 1.03
        requested = bench.motion.fastest_turn_rad_s(axis)
        assert rates.max() == pytest.approx(FASTEST_JOINT_RAD_S, rel=0.03) or requested == FASTEST_TURN_RAD_S

    @given(angles)
    def test_tool_is_turned_by_its_yaw_first_and_leans_then(self, turn):
        wanted = pin.exp3(np.array([turn[0], turn[1], 0.0])) @ pin.exp3(np.array([0.0, 0.0, turn[2]]))
        np.testing.assert_allclose(orientation(turn), wanted, atol=1e-12)

    @given(angles)
    def test_lean_and_yaw_are_told_from_the_orientation(self, turn):
        np.testing.assert_allclose(turn_of(orientation(turn)), turn, atol=1e-9)

    def test_it_gives_way_with_the_torque_and_no_faster_than_it_may(self):
        giving = AngularCompliance(0.4, 0.2, 0.1)
        assert giving.rate_rad_s((0.1, -0.05, 0.1)) == pytest.approx((0.04, -0.02, 0.02))
        assert np.linalg.norm(giving.rate_rad_s((9.0, 9.0, 9.0))) == pytest.approx(0.1)
