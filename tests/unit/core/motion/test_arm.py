"""The arms that come with palpate: complete descriptions, and clear words when a file is missing."""

import sys
from dataclasses import replace
from importlib.metadata import EntryPoint
from math import degrees
from pathlib import Path

import pytest

from palpate.core.errors import AssetError, ConfigurationError
from palpate.core.motion import Kinematics
from palpate.core.motion import arm as arm_module
from palpate.core.motion.arm import ARMS, ArmDescription, arm_named
from tests.support.tool import TOOL
from tests.unit.core.motion.limits import within_limits

arms = pytest.mark.parametrize("arm", ARMS.values(), ids=ARMS.keys())


def test_arms_are_found_by_name() -> None:
    own = {"ur3e", "ur5e", "ur10e", "ur16e", "ur20"}
    assert set(ARMS) == {"zebra-zero", "ur3", "ur5", "ur10", "panda", "z1", "xarm7", *own}
    for name, arm in ARMS.items():
        assert arm_named(name) is arm
        assert arm.name == name


def test_an_unknown_arm_is_refused_with_the_known_ones() -> None:
    with pytest.raises(ConfigurationError, match="one of zebra-zero, ur3, ur5, ur10") as caught:
        arm_named("puma")
    assert (caught.value.field, caught.value.value) == ("arm", "puma")


@arms
def test_a_description_fits_its_urdf(arm: ArmDescription) -> None:
    kinematics = Kinematics(arm, TOOL)
    assert kinematics.joints == 6 + (arm.name in ("panda", "xarm7"))
    for figures in (arm.posture_rad, arm.encoder_step_rad):
        assert len(figures) == kinematics.joints
    assert within_limits(kinematics, arm.posture_rad)
    assert min(arm.encoder_step_rad) > 0.0
    assert min(kinematics.velocity_limit_rad_s) > 0.0
    assert "assumed" in arm.evidence


def test_the_zebra_zero_counts_as_its_hardware_does() -> None:
    steps = [degrees(step) for step in arm_named("zebra-zero").encoder_step_rad]
    assert steps[:3] == pytest.approx([0.001875] * 3, rel=1e-12)  # 192 000 counts a turn
    assert steps[3:] == pytest.approx([360 / 69_332] * 3, rel=1e-12)


def test_a_missing_robot_data_package_is_named(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(sys, "path", [str(tmp_path)])
    with pytest.raises(AssetError, match="PyPI package example-robot-data must be installed") as caught:
        arm_named("ur5").find_urdf()
    assert (caught.value.field, caught.value.value) == ("arm", "ur5")
    assert "\n" not in str(caught.value)


def test_a_package_that_no_urdf_is_found_in_is_named_as_it_was_written() -> None:
    arm = replace(arm_named("ur5"), urdf="package://no-such/x.urdf")
    with pytest.raises(AssetError, match=r"'package://no-such/x\.urdf' is refused: a path, or"):
        arm.find_urdf()


def test_the_robot_data_package_is_found_wherever_the_path_leads(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    relative = "cmeel.prefix/share/example-robot-data/robots/ur_description/urdf/ur5_robot.urdf"
    urdf = tmp_path / "second" / relative
    urdf.parent.mkdir(parents=True)
    urdf.touch()
    monkeypatch.setattr(sys, "path", [str(tmp_path / "first"), str(tmp_path / "second")])
    assert arm_named("ur5").find_urdf() == urdf


def test_an_arm_of_another_package_is_found_by_its_entry_point(monkeypatch: pytest.MonkeyPatch) -> None:
    bench = replace(ARMS["ur5"], name="bench")
    monkeypatch.setattr(sys.modules[__name__], "BENCH", bench, raising=False)
    entries = [EntryPoint(name, f"{__name__}:{at}", "palpate.arms") for name, at in (("own", "BENCH"), ("no", "sys"))]
    monkeypatch.setattr(arm_module, "entry_points", lambda group: entries if group == "palpate.arms" else [])
    assert arm_named("own") is bench
    with pytest.raises(ConfigurationError, match="an ArmDescription behind "):
        arm_named("no")
    with pytest.raises(ConfigurationError, match="xarm7, no, own, or a table"):
        arm_named("puma")
