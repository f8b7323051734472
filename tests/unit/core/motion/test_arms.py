"""Arms: those that come with palpate, those of a URDF, and what is refused in one line."""

import re
import sys
from dataclasses import replace
from importlib.metadata import EntryPoint
from math import degrees
from pathlib import Path

import numpy as np
import pytest

from palpate.core.errors import AssetError, ConfigurationError
from palpate.core.motion import Kinematics, ToolGeometry
from palpate.core.motion import arm as arm_module
from palpate.core.motion.arm import ARMS, ArmDescription, arm_named
from palpate.core.motion.model import controller_frames
from tests.support.tool import TOOL
from tests.unit.core.motion.limits import within_limits

arms = pytest.mark.parametrize("arm", ARMS.values(), ids=ARMS.keys())


class TestArms:
    def test_arms_are_found_by_name(self):
        own = {"ur3e", "ur5e", "ur10e", "ur16e", "ur20"}
        assert set(ARMS) == {"zebra-zero", "ur3", "ur5", "ur10", "panda", "z1", "xarm7", *own}
        for name, arm in ARMS.items():
            assert arm_named(name) is arm
            assert arm.name == name

    def test_unknown_arm_is_refused_with_the_known_ones(self):
        with pytest.raises(ConfigurationError, match="one of zebra-zero, ur3, ur5, ur10") as caught:
            arm_named("puma")
        assert (caught.value.field, caught.value.value) == ("arm", "puma")

    @arms
    def test_description_fits_its_urdf(self, arm):
        kinematics = Kinematics(arm, TOOL)
        assert kinematics.joints == 6 + (arm.name in ("panda", "xarm7"))
        for figures in (arm.posture_rad, arm.encoder_step_rad):
            assert len(figures) == kinematics.joints
        assert within_limits(kinematics, arm.posture_rad)
        assert min(arm.encoder_step_rad) > 0.0
        assert min(kinematics.velocity_limit_rad_s) > 0.0
        assert "assumed" in arm.evidence

    def test_zebra_zero_counts_as_its_hardware_does(self):
        steps = [degrees(step) for step in arm_named("zebra-zero").encoder_step_rad]
        assert steps[:3] == pytest.approx([0.001875] * 3, rel=1e-12)  # 192 000 counts a turn
        assert steps[3:] == pytest.approx([360 / 69_332] * 3, rel=1e-12)

    def test_missing_robot_data_package_is_named(self, monkeypatch, tmp_path):
        monkeypatch.setattr(sys, "path", [str(tmp_path)])
        with pytest.raises(AssetError, match="install the PyPI package example-robot-data") as caught:
            arm_named("ur5").find_urdf()
        assert (caught.value.field, caught.value.value) == ("arm", "ur5")
        assert "\n" not in str(caught.value)

    def test_arm_of_another_package_is_found_by_its_entry_point(self, monkeypatch):
        bench = replace(ARMS["ur5"], name="bench")
        monkeypatch.setattr(sys.modules[__name__], "BENCH", bench, raising=False)
        entries = [
            EntryPoint(name, f"{__name__}:{at}", "palpate.arms") for name, at in (("own", "BENCH"), ("no", "sys"))
        ]
        monkeypatch.setattr(arm_module, "entry_points", lambda group: entries if group == "palpate.arms" else [])
        assert arm_named("own") is bench
        with pytest.raises(ConfigurationError, match="an ArmDescription at "):
            arm_named("no")
        with pytest.raises(ConfigurationError, match="xarm7, no, own, or a table"):
            arm_named("puma")


SIX = (0.1, 0.5, 0.2, 0.8, -0.1, 0.6)


def urdf(path, joints, more=""):
    """An arm of that many joints that ends in the link ``tool``."""
    links = "".join(f'<link name="l{i}"/>' for i in range(joints + 1))
    chain = "".join(
        f'<joint name="j{i}" type="revolute"><parent link="l{i}"/><child link="l{i + 1}"/>'
        f'<origin xyz="0 0 0.15"/><axis xyz="0 {i % 2} {1 - i % 2}"/>'
        f'<limit lower="-2.5" upper="2.5" velocity="1" effort="1"/></joint>'
        for i in range(joints)
    )
    end = f'<link name="tool"/><joint name="end" type="fixed"><parent link="l{joints}"/><child link="tool"/></joint>'
    path.write_text(f'<robot name="any">{links}{chain}{end}{more}</robot>')
    return str(path)


def altered(path, *changes):
    text = Path(urdf(path, 6)).read_text()
    for old, new in changes:
        assert old in text
        text = text.replace(old, new, 1)
    path.write_text(text)
    return ArmDescription(str(path), "tool", SIX)


def calibration(path, **changes):
    """The nominal UR5e in the format of the maker's ROS driver, with changes to its third joint."""
    origins = {
        "shoulder": (0, 0, 0.1625, 0, 0, 0), "upper_arm": (0, 0, 0, 1.570796327, 0, 0),
        "forearm": (-0.425, 0, 0, 0, 0, 0), "wrist_1": (-0.3922, 0, 0.1333, 0, 0, 0),
        "wrist_2": (0, -0.0997, 0, 1.570796327, 0, 0),
        "wrist_3": (0, 0.0996, 0, 1.570796326589793, 3.141592653589793, 3.141592653589793),
    }  # fmt: skip
    lines = ["kinematics:"]
    for name, figures in origins.items():
        each = dict(zip(("x", "y", "z", "roll", "pitch", "yaw"), figures, strict=True))
        each |= changes if name == "forearm" else {}
        lines += [f"  {name}:", *(f"    {key}: {value}" for key, value in each.items())]
    path.write_text("\n".join([*lines, "  hash: calib_12788084448423163542", ""]))
    return str(path)


class TestUrdf:
    def test_what_lies_beyond_the_flange_and_meshes_that_are_missing_do_not_matter(self, tmp_path):
        more = (
            '<link name="finger"><visual><geometry><mesh filename="package://x/a.dae"/></geometry></visual></link>'
            '<joint name="g" type="continuous"><parent link="tool"/><child link="finger"/><axis xyz="1 0 0"/></joint>'
        )
        plain, gripper = (
            Kinematics(ArmDescription(urdf(tmp_path / f"{len(text)}.urdf", 6, more=text), "tool", SIX), TOOL)
            for text in ("", more)
        )
        assert gripper.joints == 6
        for kinematics in (plain, gripper):
            kinematics.update(SIX)
        assert gripper.tip_position_m.tolist() == plain.tip_position_m.tolist()

    def test_file_that_was_written_anew_is_read_anew_and_each_arm_has_a_model_of_its_own(self, tmp_path):
        arm = ArmDescription(urdf(tmp_path / "a.urdf", 6), "tool", SIX)
        before, again = Kinematics(arm, TOOL), Kinematics(arm, ToolGeometry(tip_m=(0.0, 0.0, 0.5)))
        Path(arm.urdf).write_text(Path(arm.urdf).read_text().replace('upper="2.5"', 'upper="2.0"'))
        after = Kinematics(arm, TOOL)
        assert [each.upper_rad[0] for each in (before, again, after)] == [2.5, 2.5, 2.0]
        for kinematics in (before, again, after):
            kinematics.update(SIX)
        assert before.tip_position_m.tolist() == after.tip_position_m.tolist() != again.tip_position_m.tolist()

    @pytest.mark.parametrize("axis", ["x", "y", "z"])
    def test_tool_points_along_the_axis_that_is_named(self, tmp_path, axis):
        arm = ArmDescription(urdf(tmp_path / "a.urdf", 6), "tool", SIX, tool_axis=axis)
        kinematics = Kinematics(arm, TOOL)
        kinematics.update(SIX)
        flange = kinematics.sensor_in_base.translation - 0.03 * kinematics.tip_rotation[:, 2]
        np.testing.assert_allclose(kinematics.tip_position_m, flange + 0.17 * kinematics.tip_rotation[:, 2], atol=1e-15)
        by_z = Kinematics(ArmDescription(arm.urdf, "tool", SIX), TOOL)
        by_z.update(SIX)
        np.testing.assert_allclose(kinematics.tip_rotation[:, 2], by_z.tip_rotation[:, "xyz".index(axis)], atol=1e-15)
        assert np.linalg.det(kinematics.tip_rotation) == pytest.approx(1.0)

    @pytest.mark.parametrize(
        ("limit", "accepted"),
        [
            ("", "limits of 'j0': state [arm] lower_rad and upper_rad"),
            ('<limit upper="1" effort="1"/>', "no speed of 'j0': state [arm] velocity_limit_rad_s"),
            ('<limit lower="-1" upper="1" velocity="0"/>', "no speed of 'j0'"),
            ('<limit lower="-360" upper="360" velocity="1"/>', "'j0' in rad: -360 to 360 is more than two turns"),
        ],
    )
    def test_joint_without_limits_is_refused_in_one_line_unless_the_table_has_them(
        self, tmp_path, limit, accepted, capfd
    ):
        path = tmp_path / "a.urdf"
        text = Path(urdf(path, 6)).read_text()
        path.write_text(text.replace('<limit lower="-2.5" upper="2.5" velocity="1" effort="1"/>', limit, 1))
        with pytest.raises(AssetError, match=re.escape(accepted)):
            Kinematics(ArmDescription(str(path), "tool", SIX), TOOL)
        own = {"lower_rad": (-1.5,) * 6, "upper_rad": (1.5,) * 6, "velocity_limit_rad_s": (0.5,) * 6}
        kinematics = Kinematics(ArmDescription(str(path), "tool", SIX, **own), TOOL)
        assert (kinematics.lower_rad[0], kinematics.upper_rad[0], kinematics.velocity_limit_rad_s[0]) == (
            -1.5,
            1.5,
            0.5,
        )
        assert capfd.readouterr() == ("", "")

    @pytest.mark.parametrize(
        ("field", "vector", "named", "accepted"),
        [
            ("posture_rad", (0.0, 2.6, 0.0, 0.0, 0.0, 0.0), "arm.posture_rad[1]", "from -2.5 to 2.5, the limits of"),
            ("posture_rad", (0.0,) * 5, "arm.posture_rad", "6 or 7 numbers"),
            ("lower_rad", (2.5,) * 6, "arm.lower_rad", "less than upper_rad = 2.5 at joint j0"),
            ("upper_rad", (1.0,), "arm.upper_rad", "6 numbers, one per joint"),
            ("velocity_limit_rad_s", (0.0,) * 6, "arm.velocity_limit_rad_s[0]", "above 0"),
        ],
    )  # fmt: skip
    def test_posture_and_limits_must_fit(self, tmp_path, field, vector, named, accepted):
        given = {"urdf": urdf(tmp_path / "a.urdf", 6), "flange": "tool", "posture_rad": SIX, field: vector}
        with pytest.raises(ConfigurationError) as caught:
            Kinematics(ArmDescription(**given), TOOL)
        assert caught.value.field == named
        assert accepted in str(caught.value)

    def test_joint_that_turns_faster_than_any_command_may_jump_is_led_more_slowly(self, tmp_path):
        kinematics = Kinematics(altered(tmp_path / "a.urdf", ('velocity="1"', 'velocity="20"')), TOOL)
        assert kinematics.velocity_limit_rad_s.tolist() == [6.9, 1.0, 1.0, 1.0, 1.0, 1.0]

    @pytest.mark.parametrize(
        ("old", "new", "accepted"),
        [
            ("tool", "tool", "no link 'hand' below a joint, for the flange"),
            ('type="revolute"', 'type="floating"', "no chain of revolute joints to 'tool': 'j0' is floating"),
            ('type="revolute"', 'type="fixed"', "no chain of 6 or 7 joints to 'tool': it has 5"),
            ("</robot>", '<link name="second"/></robot>', "no tree: no joint connects 'l0' and 'second'"),
            ("</robot>", '<link name="l3"/></robot>', "no unique names: 'l3' occurs twice"),
            ('name="j1"', 'name="j0"', "no unique names: 'j0' occurs twice"),
            ('xyz="0 0 0.15"', 'xyz="0 0 high"', "no three numbers in xyz='0 0 high'"),
            ('xyz="0 0 1"', 'xyz="0 0 nan"', "no three numbers in xyz='0 0 nan'"),
            # What Pinocchio would die of, or take silently.
            ('xyz="0 0 0.15"', 'xyz="0 0 ${height}"', "no plain URDF: run xacro first"),
            ('<child link="l1"/>', '<child link="l0"/>', "no tree: links 'l0' are a loop"),
            ("</robot>", '<joint name="x"><parent link="l3"/><child link="l0"/></joint></robot>', "are a loop"),
            ("</robot>", '<joint name="x"><parent link="l0"/><child link="l3"/></joint></robot>', "'l3' is below "),
            ('<link name="l2"/>', "", "no link 'l2', which 'j1' connects"),
            ('<axis xyz="0 0 1"/>', '<axis xyz="0 0 2"/>', "no valid axis of 'j0': the length of 0 0 2 is not 1"),
            ('xyz="0 0 0.15"', 'xyz="0 0 150"', "no lengths in metres: its joints are 150.8 m apart in total"),
        ],
    )  # fmt: skip
    def test_urdf_that_is_no_arm_is_refused_in_one_line(self, tmp_path, old, new, accepted, capfd):
        arm = replace(altered(tmp_path / "a.urdf", (old, new)), flange="hand" if old == "tool" else "tool")
        with pytest.raises(AssetError) as caught:
            Kinematics(arm, TOOL)
        assert accepted in str(caught.value)
        assert "a.urdf" in str(caught.value)
        assert "\n" not in str(caught.value)
        assert capfd.readouterr() == ("", "")

    def test_calibration_of_a_controller_replaces_the_nominal_origins(self, tmp_path):
        arm, q = arm_named("ur5e"), (0.1, -1.2, 1.3, -1.6, -1.5, 0.2)
        nominal = controller_frames(arm, q)[1]
        same = controller_frames(replace(arm, calibration=calibration(tmp_path / "same.yaml")), q)[1]
        np.testing.assert_allclose(same.homogeneous, nominal.homogeneous, atol=1e-8)
        longer = controller_frames(replace(arm, calibration=calibration(tmp_path / "longer.yaml", x=-0.428)), q)[1]
        assert np.linalg.norm(longer.translation - nominal.translation) == pytest.approx(3e-3, abs=1e-9)

    @pytest.mark.parametrize(
        ("arm", "changes", "accepted"),
        [
            ("ur10e", {}, "no calibration of this arm: it shifts 'elbow_joint' by 188 mm"),
            ("panda", {}, "no calibration is possible for an arm of 7 joints"),
            ("ur5e", {"yaw": float("nan")}, "x, y, z, roll, pitch and yaw of forearm"),
        ],
    )
    def test_calibration_of_another_arm_is_refused(self, tmp_path, arm, changes, accepted):
        other = replace(arm_named(arm), calibration=calibration(tmp_path / "c.yaml", **changes))
        with pytest.raises(AssetError, match=re.escape(accepted)):
            Kinematics(other, TOOL)
