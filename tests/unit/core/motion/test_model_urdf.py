"""What an arm's URDF must be, and one line that says what it is not."""

import os
from pathlib import Path

import numpy as np
import pytest

from palpate.core.errors import AssetError, ConfigurationError
from palpate.core.motion import ArmDescription, Kinematics, ToolGeometry

SIX = (0.1, 0.5, 0.2, 0.8, -0.1, 0.6)


def urdf(path: Path, joints: int, kind: str = "revolute", more: str = "") -> str:
    """An arm of that many joints, the third of another kind, that ends in the link ``tool``."""
    links = "".join(f'<link name="l{i}"/>' for i in range(joints + 1))
    chain = "".join(
        f'<joint name="j{i}" type="{kind if i == 2 else "revolute"}"><parent link="l{i}"/><child link="l{i + 1}"/>'
        f'<origin xyz="0 0 0.15"/><axis xyz="0 {i % 2} {1 - i % 2}"/>'
        f'<limit lower="-2.5" upper="2.5" velocity="1" effort="1"/></joint>'
        for i in range(joints)
    )
    end = f'<link name="tool"/><joint name="end" type="fixed"><parent link="l{joints}"/><child link="tool"/></joint>'
    path.write_text(f'<robot name="any">{links}{chain}{end}{more}</robot>')
    return str(path)


def test_what_lies_beyond_the_flange_and_meshes_that_are_missing_do_not_matter(tmp_path: Path) -> None:
    more = (
        '<link name="finger"><visual><geometry><mesh filename="package://nowhere/a.dae"/></geometry></visual></link>'
        '<joint name="grip" type="continuous"><parent link="tool"/><child link="finger"/><axis xyz="1 0 0"/></joint>'
    )
    plain, gripper = (
        Kinematics(ArmDescription(urdf(tmp_path / f"{len(text)}.urdf", 6, more=text), "tool", SIX), ToolGeometry())
        for text in ("", more)
    )
    assert gripper.joints == 6
    for kinematics in (plain, gripper):
        kinematics.update(SIX)
    assert gripper.tip_position_m.tolist() == plain.tip_position_m.tolist()


def test_a_file_that_was_written_anew_is_read_anew_and_each_arm_has_a_model_of_its_own(tmp_path: Path) -> None:
    arm = ArmDescription(urdf(tmp_path / "a.urdf", 6), "tool", SIX)
    before, again = Kinematics(arm, ToolGeometry()), Kinematics(arm, ToolGeometry(0.0, 0.5))
    Path(arm.urdf).write_text(Path(arm.urdf).read_text().replace('upper="2.5"', 'upper="2.0"'))
    after = Kinematics(arm, ToolGeometry())
    assert [each.upper_rad[0] for each in (before, again, after)] == [2.5, 2.5, 2.0]
    for kinematics in (before, again, after):
        kinematics.update(SIX)
    assert before.tip_position_m.tolist() == after.tip_position_m.tolist() != again.tip_position_m.tolist()


@pytest.mark.parametrize("axis", ["x", "y", "z"])
def test_the_tool_points_along_the_axis_that_is_named(tmp_path: Path, axis: str) -> None:
    arm = ArmDescription(urdf(tmp_path / "a.urdf", 6), "tool", SIX, tool_axis=axis)
    kinematics = Kinematics(arm, ToolGeometry())
    kinematics.update(SIX)
    flange = kinematics.sensor_in_base.translation - 0.03 * kinematics.tip_rotation[:, 2]
    np.testing.assert_allclose(kinematics.tip_position_m, flange + 0.17 * kinematics.tip_rotation[:, 2], atol=1e-15)
    by_z = Kinematics(ArmDescription(arm.urdf, "tool", SIX), ToolGeometry())
    by_z.update(SIX)
    np.testing.assert_allclose(kinematics.tip_rotation[:, 2], by_z.tip_rotation[:, "xyz".index(axis)], atol=1e-15)
    assert np.linalg.det(kinematics.tip_rotation) == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("joints", "kind", "flange", "accepted"),
    [
        (6, "continuous", "tool", "'j2' is continuous: write revolute, with the limits"),
        (6, "floating", "tool", "revolute joints only up to 'tool'; 'j2' is floating"),
        (6, "prismatic", "tool", "'j2' is prismatic"),
        (5, "revolute", "tool", "6 or 7 joints lead to 'tool', not 5"),
        (8, "revolute", "tool", "6 or 7 joints lead to 'tool', not 8"),
        (7, "revolute", "tool", "6 joints, as in posture_rad, lead to 'tool', not 7"),
        (6, "revolute", "hand", "a frame 'hand' for the flange"),
    ],
)
def test_an_arm_that_cannot_be_used_is_refused(
    tmp_path: Path, joints: int, kind: str, flange: str, accepted: str
) -> None:
    with pytest.raises(AssetError) as caught:
        Kinematics(ArmDescription(urdf(tmp_path / "a.urdf", joints, kind), flange, SIX), ToolGeometry())
    assert accepted in str(caught.value)
    assert "a.urdf" in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("limit", ["", '<limit upper="1" effort="1"/>', '<limit upper="nan" effort="1" velocity="1"/>'])
def test_a_joint_without_limits_is_refused_in_one_line(
    tmp_path: Path, limit: str, capfd: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "a.urdf"
    text = Path(urdf(path, 6)).read_text()
    path.write_text(text.replace('<limit lower="-2.5" upper="2.5" velocity="1" effort="1"/>', limit, 1))
    with pytest.raises(AssetError, match="limits of 'j0': <limit lower="):
        Kinematics(ArmDescription(str(path), "tool", SIX), ToolGeometry())
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize(
    ("old", "new", "accepted"),
    [
        ("</robot>", '<link name="second"/></robot>', "Two root links found: [l0] and [second]"),
        ('name="j3"', 'name="j2"', "joint 'j2' is not unique"),
        ('xyz="0 0 0.15"', 'xyz="0 0 ${height}"', "Unable to parse component [${height}] to a double"),
    ],
)
def test_what_the_library_says_of_a_urdf_is_in_the_one_line(
    tmp_path: Path, old: str, new: str, accepted: str, capfd: pytest.CaptureFixture[str]
) -> None:
    path = Path(urdf(tmp_path / "a.urdf", 6))
    path.write_text(path.read_text().replace(old, new, 1))
    with pytest.raises(AssetError) as caught:
        Kinematics(ArmDescription(str(path), "tool", SIX), ToolGeometry())
    assert accepted in str(caught.value)
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize(
    ("field", "vector", "named", "accepted"),
    [
        ("posture_rad", (0.0, 2.6, 0.0, 0.0, 0.0, 0.0), "arm.posture_rad[1]", "from -2.5 to 2.5, the limits of"),
        ("posture_rad", (0.0,) * 5, "arm.posture_rad", "6 or 7 numbers"),
        ("lower_rad", (2.5,) * 6, "arm.lower_rad", "less than upper_rad = 2.5 at joint j0"),
        ("upper_rad", (1.0,), "arm.upper_rad", "6 numbers, one a joint"),
        ("velocity_limit_rad_s", (0.0,) * 6, "arm.velocity_limit_rad_s[0]", "above 0"),
    ],
)  # fmt: skip
def test_posture_and_limits_must_fit(
    tmp_path: Path, field: str, vector: tuple[float, ...], named: str, accepted: str
) -> None:
    given = {"urdf": urdf(tmp_path / "a.urdf", 6), "flange": "tool", "posture_rad": SIX, field: vector}
    with pytest.raises(ConfigurationError) as caught:
        Kinematics(ArmDescription(**given), ToolGeometry())  # type: ignore[arg-type]
    assert caught.value.field == named
    assert accepted in str(caught.value)


def test_limits_of_the_description_are_those_of_the_arm(tmp_path: Path) -> None:
    arm = ArmDescription(
        urdf(tmp_path / "a.urdf", 6), "tool", SIX, lower_rad=(-1.0,) * 6, velocity_limit_rad_s=(0.5,) * 6
    )
    kinematics = Kinematics(arm, ToolGeometry())
    assert kinematics.lower_rad.tolist() == [-1.0] * 6
    assert kinematics.upper_rad.tolist() == [2.5] * 6
    assert kinematics.velocity_limit_rad_s.tolist() == [0.5] * 6


def test_a_process_without_a_standard_error_has_its_arm(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def closed(descriptor: int) -> int:
        raise OSError(9, "Bad file descriptor")

    arm = ArmDescription(urdf(tmp_path / "arm.urdf", 6), "tool", SIX)
    monkeypatch.setattr(os, "dup", closed)
    assert Kinematics(arm, ToolGeometry()).joints == 6
