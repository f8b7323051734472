"""Kinematics against the table of the arm, an oracle of its own, finite differences and spatial algebra."""

from collections.abc import Sequence
from dataclasses import replace
from math import cos, pi, sin
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.adapters.config import scenario
from palpate.core.errors import AssetError
from palpate.core.motion import ToolGeometry
from palpate.core.motion.arm import ARMS, ArmDescription, arm_named
from palpate.core.motion.model import Array, FixedFrame, Kinematics, rotated, wrench_about
from palpate.core.ports.values import Vector3
from palpate.core.trial import goal_in_base
from tests.support.tool import TOOL

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


# a2, a3, d1, d4, d5, d6 in m, as Universal Robots publishes them on its page of DH parameters.
UR_LENGTHS = {
    "ur3e": (-0.24355, -0.2132, 0.15185, 0.13105, 0.08535, 0.0921),
    "ur5e": (-0.425, -0.3922, 0.1625, 0.1333, 0.0997, 0.0996),
    "ur10e": (-0.6127, -0.57155, 0.1807, 0.17415, 0.11985, 0.11655),
    "ur16e": (-0.4784, -0.36, 0.1807, 0.17415, 0.11985, 0.11655),
    "ur20": (-0.8620, -0.7287, 0.2363, 0.2010, 0.1593, 0.1543),
}


def flange_by_table(q: Array, table: Sequence[tuple[float, float, float, float]] = ZEBRA_DH) -> Array:
    """Homogeneous transform of the flange, (4, 4), from a DH table alone."""
    placement = np.eye(4)
    for angle, (offset, d, a, alpha) in zip(q, table, strict=True):
        c, s, ca, sa = cos(angle + offset), sin(angle + offset), cos(alpha), sin(alpha)
        placement = placement @ np.array(
            [[c, -s * ca, s * sa, a * c], [s, c * ca, -c * sa, a * s], [0, sa, ca, d], [0, 0, 0, 1]]
        )
    return placement


def random_angles(kinematics: Kinematics, count: int) -> Array:
    rng = np.random.default_rng(7)
    return rng.uniform(kinematics.lower_rad, kinematics.upper_rad, (count, kinematics.joints))


def test_at_zero_the_zebra_zero_stands_straight_up() -> None:
    kinematics = Kinematics(ZEBRA, NO_TOOL)
    kinematics.update((0.0,) * 6)
    assert kinematics.tip_position_m == pytest.approx([0.0, 0.0, 0.8625], abs=1e-15)
    assert kinematics.tip_rotation == pytest.approx(np.eye(3), abs=1e-15)


def test_the_zebra_zero_follows_its_table_everywhere() -> None:
    kinematics = Kinematics(ZEBRA, NO_TOOL)
    for q in random_angles(kinematics, 300):
        kinematics.update(q)
        expected = flange_by_table(q)
        np.testing.assert_allclose(kinematics.tip_position_m, expected[:3, 3], atol=1e-12)
        np.testing.assert_allclose(kinematics.tip_rotation, expected[:3, :3], atol=1e-12)


@pytest.mark.parametrize("name", UR_LENGTHS)
def test_arms_of_universal_robots_follow_their_published_table_everywhere(name: str) -> None:
    a2, a3, d1, d4, d5, d6 = UR_LENGTHS[name]
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


def test_at_zero_a_ur10e_points_forward() -> None:
    kinematics = Kinematics(arm_named("ur10e"), NO_TOOL)
    kinematics.update((0.0,) * 6)
    # By hand: x = 612.7 + 571.55, y = 174.15 + 116.55, z = 180.7 - 119.85 mm.
    assert kinematics.tip_position_m == pytest.approx([1.18425, 0.2907, 0.06085], abs=1e-9)


def test_the_joint_limits_are_those_of_the_table() -> None:
    kinematics = Kinematics(ZEBRA, NO_TOOL)
    assert kinematics.lower_rad.tolist() == [-3.14, -1.07, -1.70, -3.14, -3.14, -3.14]
    assert kinematics.upper_rad.tolist() == [3.14, 1.70, 1.07, 3.14, 3.14, 3.14]
    assert kinematics.velocity_limit_rad_s.tolist() == [1.0] * 6


def test_the_tool_sits_on_the_flange_along_its_axis() -> None:
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


def test_the_ur5_is_the_ur5() -> None:
    # Reach of the data sheet, 850 mm; published kinematic chain: a2 + a3 = 0.425 + 0.39225 m, d4 = 0.10915 m.
    kinematics = Kinematics(arm_named("ur5"), NO_TOOL)
    kinematics.update((0.0,) * 6)
    x, y, z = kinematics.tip_position_m
    assert x == pytest.approx(0.81725, abs=1e-4)
    assert abs(y) == pytest.approx(0.10915 + 0.0823, abs=1e-3)
    assert z == pytest.approx(0.0892 - 0.0946, abs=1e-3)


@arms
def test_the_jacobian_is_the_derivative_of_the_tip(arm: ArmDescription) -> None:
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


def test_the_tip_error_leads_to_the_target() -> None:
    kinematics = Kinematics(ZEBRA, TOOL)
    here, there = random_angles(kinematics, 2)
    kinematics.update(there)
    target = kinematics.tip_in_base
    assert kinematics.tip_error(target) == pytest.approx(np.zeros(6), abs=1e-15)
    kinematics.update(here)
    reached = kinematics.tip_in_base * pin.exp6(kinematics.tip_error(target))
    np.testing.assert_allclose(reached.homogeneous, target.homogeneous, atol=1e-12)


def test_views_follow_and_copies_stay() -> None:
    kinematics = Kinematics(ZEBRA, TOOL)
    first, second = random_angles(kinematics, 2)
    kinematics.update(first)
    view, copy, sensor = kinematics.tip_position_m, kinematics.tip_in_base, kinematics.sensor_in_base
    before, sensor_before = copy.translation.copy(), sensor.translation.copy()
    kinematics.update(second)
    assert view.tolist() != before.tolist()
    assert copy.translation.tolist() == before.tolist()
    assert sensor.translation.tolist() == sensor_before.tolist()


components = st.floats(-1e3, 1e3)
vectors = st.tuples(components, components, components)


@given(force=vectors, torque=vectors, point=vectors)
def test_wrench_transport_is_that_of_spatial_algebra(force: Vector3, torque: Vector3, point: Vector3) -> None:
    shift = pin.SE3(np.eye(3), np.array(point))
    expected = shift.actInv(pin.Force(np.array(force), np.array(torque)))
    np.testing.assert_allclose(wrench_about(force, torque, point), expected.angular, rtol=1e-12, atol=1e-9)


@pytest.mark.parametrize("content", [None, "", "not a URDF", "<model/>"])
def test_a_urdf_that_cannot_be_read_is_an_asset_error(tmp_path: Path, content: str | None) -> None:
    path = tmp_path / "arm.urdf"
    if content is not None:
        path.write_text(content)
    with pytest.raises(AssetError, match="a readable URDF") as caught:
        Kinematics(replace(ZEBRA, urdf=str(path)), TOOL)
    assert (caught.value.field, caught.value.value) == ("arm", str(path))
    assert "\n" not in str(caught.value)


def test_a_fixed_frame_turns_vectors_as_pinocchio_does() -> None:
    placement, other, place = pin.SE3.Random(), pin.SE3.Random().rotation, np.random.default_rng(3).normal(size=3)
    frame, xyz = FixedFrame(placement), tuple(place.tolist())
    assert frame.vector(xyz) == pytest.approx(placement.rotation.T @ place)
    assert frame.vector_of(other.tolist(), xyz) == pytest.approx(placement.rotation.T @ other @ place)
    assert rotated(placement.rotation.tolist(), xyz) == pytest.approx(placement.rotation @ place)


def test_the_task_frame_equals_pinocchio_to_the_bit() -> None:
    goal = goal_in_base(scenario("paper").task.goal)
    frame = FixedFrame(goal)
    for place in np.random.default_rng(3).normal(size=(100, 3)):
        assert np.array(frame.place_m(place.tolist())).tobytes() == goal.actInv(place).tobytes()
        assert np.array(frame.place_in_base_m(place.tolist())).tobytes() == goal.act(place).tobytes()
