"""Inertias and servos of an arm whose description gives none, and names that clash with the cell's own."""

import re
from dataclasses import replace

import pytest

from palpate.core.errors import AssetError
from palpate.core.motion import Kinematics
from palpate.core.motion.arm import ARMS, arm_named
from palpate.core.trial import GoalConfig, goal_in_base
from palpate.simulation.work_cell.arm_dynamics import body_inertias, inertia_lines, servos
from palpate.simulation.work_cell.config import CellConfig
from palpate.simulation.work_cell.model import build_work_cell
from tests.support.tool import TOOL

GOAL = goal_in_base(GoalConfig())

INERTIAL = re.compile(r"(?s)<inertial>.*?</inertial>")


def zebra(tmp_path, old, new, count=0):
    text = re.sub(old, new, arm_named("zebra-zero").find_urdf().read_text(), count=count)
    (tmp_path / "other.urdf").write_text(text)
    return replace(arm_named("zebra-zero"), urdf=str(tmp_path / "other.urdf"))


def compiled(arm):
    kinematics = Kinematics(arm, TOOL)
    return build_work_cell(kinematics, CellConfig(), goal_in_base=GOAL, tool_yaw_rad=0.0, period_s=1.0 / 140)


@pytest.mark.parametrize("mass", ["", '<mass value="-3"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/>'])
def test_body_without_mass_has_that_of_a_capsule_and_a_line_says_so(tmp_path, mass):
    arm = zebra(tmp_path, INERTIAL, f"<inertial>{mass}</inertial>" if mass else "", count=1)
    (line,) = inertia_lines(arm)
    assert line == "the URDF has no mass or inertia of what joint_1 move: estimated as those of capsules"
    waist = body_inertias(Kinematics(arm, TOOL))[0][0]
    # 0.24 m long, 0.04 m in radius: 1200 kg/m3 x (pi r2 l + 4/3 pi r3).
    assert waist.mass == pytest.approx(1.7693, rel=1e-3)
    assert waist.lever == pytest.approx([0.0, 0.0, 0.12])
    assert compiled(arm).body("link_1").mass[0] == pytest.approx(waist.mass)


@pytest.mark.parametrize("name", sorted(set(ARMS) - {"ur20"}))
def test_arms_that_come_with_palpate_have_the_usual_servos(name):
    kinematics = Kinematics(arm_named(name), TOOL)
    stiffness, armature = servos(kinematics, body_inertias(kinematics)[0])
    proximal = kinematics.joints - 3
    assert stiffness == [2e4] * proximal + [4e3] * 3
    assert armature == [2.0] * proximal + [0.4] * 3
    assert not inertia_lines(name)


def test_servos_grow_with_the_inertia_of_the_arm_unless_they_are_given(tmp_path):
    heavy = zebra(tmp_path, r'<mass value="[0-9.]+"', '<mass value="35"')
    kinematics = Kinematics(heavy, TOOL)
    inertias = body_inertias(kinematics)[0]
    stiffness, armature = servos(kinematics, inertias)
    assert stiffness[1] > 2.5e4
    assert stiffness[1] / armature[1] == pytest.approx(1e4)
    own = replace(heavy, servo_stiffness_Nm_per_rad=(1e3,) * 6)
    assert servos(Kinematics(own, TOOL), inertias) == ([1e3] * 6, armature)


@pytest.mark.parametrize("joint", ["slide_x", "servo_1", "plate"])
def test_joint_may_have_a_name_of_the_cell(tmp_path, joint):
    assert compiled(zebra(tmp_path, 'name="joint_2"', f'name="{joint}"')).njnt == 12


def test_refusal_of_mujoco_is_one_line(tmp_path):
    inertia = '<mass value="1e-18"/><inertia ixx="1e-18" ixy="0" ixz="0" iyy="1e-18" iyz="0" izz="1e-18"/>'
    with pytest.raises(AssetError, match=r"no URDF that MuJoCo can simulate \(.*\)") as caught:
        compiled(zebra(tmp_path, INERTIAL, f"<inertial>{inertia}</inertial>"))
    assert "\n" not in str(caught.value)
