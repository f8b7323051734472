"""MuJoCo and Pinocchio have one arm between them."""

import xml.etree.ElementTree as ET

import mujoco
import numpy as np
import pytest

from palpate.adapters.config.run import RunConfig
from palpate.adapters.mujoco.rig import SimulatedRig
from palpate.core.motion.arm import ARMS, arm_named
from palpate.core.motion.model import Kinematics
from tests.support.physics_bench import ready_pose
from tests.support.tool import TOOL


@pytest.mark.parametrize("arm", ARMS)
def test_tip_is_where_forward_kinematics_puts_it(arm):
    kinematics = Kinematics(arm_named(arm), TOOL)
    rng = np.random.default_rng(1)
    with SimulatedRig(RunConfig(arm=arm), ready_pose(arm)) as rig:
        model, data = rig.cell.model, rig.cell.data
        for q in rng.uniform(kinematics.lower_rad, kinematics.upper_rad, (100, kinematics.joints)):
            data.qpos[:] = 0.0  # the gripper's springs, whose joints come last, at rest
            data.qpos[: kinematics.joints] = q
            mujoco.mj_kinematics(model, data)
            kinematics.update(q)
            np.testing.assert_allclose(data.site("tip").xpos, kinematics.tip_position_m, rtol=0.0, atol=1e-9)
            np.testing.assert_allclose(
                data.site("tip").xmat.reshape(3, 3), kinematics.tip_rotation, rtol=0.0, atol=1e-9
            )
            np.testing.assert_allclose(
                data.site("wrench").xpos, kinematics.sensor_in_base.translation, rtol=0.0, atol=1e-9
            )


@pytest.mark.parametrize("arm", ARMS)
def test_every_joint_is_limited_as_the_urdf_says(arm):
    urdf = ET.parse(arm_named(arm).find_urdf()).getroot()
    kinematics = Kinematics(arm_named(arm), TOOL)
    ranges = {
        joint.attrib["name"]: (float(limit.attrib["lower"]), float(limit.attrib["upper"]))
        for joint in urdf.findall("joint")
        if joint.attrib["name"] in kinematics.model.names and (limit := joint.find("limit")) is not None
    }
    assert len(ranges) == kinematics.joints
    with SimulatedRig(RunConfig(arm=arm), ready_pose(arm)) as rig:
        for name, limits in ranges.items():
            joint = rig.cell.model.joint(f"joint_{kinematics.model.getJointId(name)}")
            assert joint.limited[0]
            assert tuple(joint.range) == limits
