"""The initial pose for trials, above the hole, and the maximum distance from it during a trial."""

from dataclasses import dataclass
from math import radians, sqrt

import numpy as np
import pinocchio as pin

from palpate.core.errors import UnreachableError
from palpate.core.motion import (
    ArmDescription,
    Array,
    InverseKinematics,
    Kinematics,
    ToolGeometry,
    arm_named,
    orientation,
)
from palpate.core.ports import PERIOD_S
from palpate.core.trial.config import TaskConfig
from palpate.core.trial.frame import goal_in_base


@dataclass(frozen=True, slots=True)
class Workspace:
    """A box in the task frame; the supervisor trips if the tip leaves it by more than its margins.

    Attributes:
        turns_deg: Maximum tool tilt and maximum turn about the tool's axis; None if the tool keeps its orientation,
            which is then not checked.
    """

    side_mm: tuple[float, float]
    above_mm: float
    below_mm: float
    turns_deg: tuple[float, float] | None = None


@dataclass(frozen=True)
class ReadyPose:
    """The initial pose for trials, above the nominal goal.

    Attributes:
        q_rad: Joint angles, (n,).
        tip_rotation: Tool orientation, (3, 3), base frame; constant during a trial.
    """

    q_rad: Array
    tip_rotation: Array


def wander_m(task: TaskConfig) -> float:
    """Return the peg's maximum distance from the nominal goal in a trial, at a corner of the exploration area."""
    centre_mm = task.start_uncertainty_mm if task.area_centre == "start" else 0.0
    return (centre_mm + sqrt(2.0) * task.area_half_width_mm) * 1e-3


def find_ready_pose(
    arm: str | ArmDescription, tool: ToolGeometry, task: TaskConfig, workspace: Workspace | None = None
) -> ReadyPose:
    """Solve for the ready pose, with the tool pointing into the hole and the yaw left free.

    Args:
        task: Task settings: goal pose, and exploration area and depth for an insertion.
        workspace: Box to reach instead of that area and depth.

    Raises:
        ConfigurationError: The arm is unknown.
        UnreachableError: The arm cannot reach the pose or the corners of the exploration area.
    """
    description = arm_named(arm)
    kinematics = Kinematics(description, tool)
    inverse = InverseKinematics(kinematics, PERIOD_S)
    goal = goal_in_base(task.goal)

    def at(x: float, y: float, z: float, rotation: Array) -> pin.SE3:
        return pin.SE3(rotation, goal.act(np.array([x, y, z])))

    height = task.ready_height_mm * 1e-3
    q = inverse.solve(
        at(0.0, 0.0, -height, goal.rotation),
        free_yaw=True,
        seed_rad=np.array(description.posture_rad),
        field="place",
    )
    kinematics.update(q)
    ready = ReadyPose(q, kinematics.tip_rotation.copy())
    reach = wander_m(task) / sqrt(2.0)
    far, aside, depth = reach, reach, task.insertion_depth_mm * 1e-3
    if workspace is not None:
        (far, aside), depth = (side * 1e-3 for side in workspace.side_mm), workspace.below_mm * 1e-3
    for x in (-far, far):
        for y in (-aside, aside):
            for z in (-height, depth):
                inverse.solve(at(x, y, z, ready.tip_rotation), free_yaw=False, seed_rad=q, field="place")
    return ready


def require_turns(
    arm: str | ArmDescription, tool: ToolGeometry, ready: ReadyPose, task: TaskConfig, turns_deg: tuple[float, float]
) -> None:
    """Reject tool rotations that the arm cannot perform above the goal.

    Args:
        turns_deg: Required tilt about x and about y, and required turn about the tool axis.

    Raises:
        UnreachableError: The arm cannot perform one of the rotations; the message names it.
    """
    description, goal = arm_named(arm), goal_in_base(task.goal)
    inverse = InverseKinematics(Kinematics(description, tool), PERIOD_S)
    place, upright = goal.act(np.array([0.0, 0.0, -task.ready_height_mm * 1e-3])), goal.rotation.T @ ready.tip_rotation
    for name, angle_deg, axis in zip(("tilt", "tilt", "yaw"), (turns_deg[0], *turns_deg), range(3), strict=True):
        for sign in (-1.0, 1.0):
            turn = [0.0, 0.0, 0.0]
            turn[axis] = radians(sign * angle_deg)
            rotation = goal.rotation @ np.array(orientation((turn[0], turn[1], turn[2]))) @ upright
            try:
                inverse.solve(pin.SE3(rotation, place), free_yaw=False, seed_rad=ready.q_rad, field="place")
            except UnreachableError as error:
                about = "xyz"[axis]
                accepted = f"a turn about {about} that {description.name} can make above the goal; or a nearer place"
                raise UnreachableError(f"task.options.most_{name}_deg", sign * angle_deg, accepted) from error
