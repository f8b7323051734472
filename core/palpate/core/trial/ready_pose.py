"""The pose above the hole from which trials begin, and how far a trial may lead from there."""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt

import numpy as np
import pinocchio as pin

from palpate.core.motion import ArmDescription, Array, InverseKinematics, Kinematics, ToolGeometry, arm_named
from palpate.core.ports import PERIOD_S
from palpate.core.trial.config import TaskConfig
from palpate.core.trial.frame import goal_in_base


@dataclass(frozen=True)
class ReadyPose:
    """The pose above the nominal goal from which trials begin.

    Attributes:
        q_rad: Joint angles, (n,).
        tip_rotation: Orientation of the tool there, (3, 3), base frame; it is kept during the trial.
    """

    q_rad: Array
    tip_rotation: Array


def wander_m(task: TaskConfig) -> float:
    """How far from the nominal goal a trial may lead the peg: to a corner of the exploration area."""
    centre_mm = task.start_uncertainty_mm if task.area_centre == "start" else 0.0
    return (centre_mm + sqrt(2.0) * task.area_half_width_mm) * 1e-3


def find_ready_pose(arm: str | ArmDescription, task: TaskConfig) -> ReadyPose:
    """Solve for the ready pose, tool pointing into the hole, its yaw left to the arm.

    Raises:
        ConfigurationError: There is no such arm.
        UnreachableError: The arm cannot get there, or not to the corners of the exploration area.
    """
    description = arm_named(arm)
    kinematics = Kinematics(description, ToolGeometry())
    inverse = InverseKinematics(kinematics, PERIOD_S)
    goal = goal_in_base(task.goal)

    def at(x: float, y: float, z: float, rotation: Array) -> pin.SE3:
        return pin.SE3(rotation, goal.act(np.array([x, y, z])))

    height = task.ready_height_mm * 1e-3
    q = inverse.solve(
        at(0.0, 0.0, -height, goal.rotation),
        free_yaw=True,
        seed_rad=np.array(description.posture_rad),
        field="task.goal",
    )
    kinematics.update(q)
    ready = ReadyPose(q, kinematics.tip_rotation.copy())
    reach = wander_m(task) / sqrt(2.0)
    for x in (-reach, reach):
        for y in (-reach, reach):
            for z in (-height, task.insertion_depth_mm * 1e-3):
                inverse.solve(at(x, y, z, ready.tip_rotation), free_yaw=False, seed_rad=q, field="task.goal")
    return ready
