"""Move a real arm from any pose to the ready pose."""

from dataclasses import dataclass
from math import copysign, pi, tau
from typing import Final

import numpy as np
import pinocchio as pin

from palpate.adapters.config import RunConfig
from palpate.adapters.hardware.guarded_ticks import GuardedTicks
from palpate.core.errors import DeviceError
from palpate.core.motion import ArmDescription, InverseKinematics, Kinematics, ToolGeometry, arm_named
from palpate.core.ports import CONTROL_RATE_HZ, PERIOD_S, JointVector, Ports
from palpate.core.supervision import WITHDRAWAL_SHARE, SampleMonitor
from palpate.core.trial import ReadyPose, goal_in_base

WITHDRAWAL_M_S: Final = 0.02
"""Speed for withdrawing a peg that was left in its hole, the same as for free motion near the plate."""
_ALONG: Final = 0.98
"""Cosine of the maximum angle between the tool and the hole at which the peg can be in the hole."""
_THERE_RAD: Final = 2e-3
"""Position tolerance for each joint at a pose. Several consecutive samples must be within it."""
_STAYS_SAMPLES: Final = 5
"""Number of consecutive samples required at a pose. An arm that is catching up may pass it at 5 mrad per sample."""
_RAMP_TICKS: Final = CONTROL_RATE_HZ
"""Number of ticks (one second) for the set-point to accelerate from rest to full speed, or to decelerate to rest.

Near the end of the path, 3 mm above the plate, an arm that lags by 0.2 s then has little to catch up.
"""
_TIMEOUT_TICKS: Final = 3 * CONTROL_RATE_HZ
"""Maximum time for the arm to catch up with its set-point."""


@dataclass(frozen=True, slots=True)
class ReadyPosePath:
    """An arm's path from any pose to the ready pose.

    Attributes:
        clear_m: Height of the tip above the plate from which the arm may move freely.
        poses_rad: Joint poses, (n,) each, to pass through in order.
    """

    arm: ArmDescription
    tool: ToolGeometry
    goal_in_base: pin.SE3
    clear_m: float
    poses_rad: tuple[JointVector, ...]


def move_to_ready(
    approach: ReadyPosePath, ports: Ports, speed_rad_s: float, limit_N: float, monitor: SampleMonitor
) -> None:
    """Withdraw the tool straight out of the hole if it is in one, then follow an approach path.

    At the end, and after any error, the arm holds its last set-point or is stopped.

    Args:
        limit_N: Force change, relative to the start or the end of the withdrawal, that stops the arm. It is doubled
            during the withdrawal, because an arm that was left pressing on something releases that force.

    Raises:
        DeviceError: An encoder may have lost a turn; the arm does not follow, is held back or touches something; or a
            sensor fails, or reports the wrong kind of wrench or the wrong frame.
    """
    begin = ports.joint_encoder.read().position_rad
    require_right_turn(approach, begin)
    path = withdrawal(approach, begin)

    def ticks_within(most_N: float) -> GuardedTicks:
        return GuardedTicks(ports, monitor, most_N, "on the path to the ready pose", lambda: ports.arm.fault or "")

    try:
        if path:
            _follow(ticks_within(WITHDRAWAL_SHARE * limit_N), path)
        ticks = ticks_within(limit_N)
        for pose in approach.poses_rad:
            begin = ports.joint_encoder.read().position_rad
            _follow(ticks, _joint_line(begin, pose, speed_rad_s))
    except BaseException:
        ports.arm.stop()
        raise


def require_right_turn(approach: ReadyPosePath, begin_rad: JointVector) -> None:
    """Reject a joint more than half a turn from the ready pose if its true angle may be one turn closer."""
    limits = Kinematics(approach.arm, approach.tool)
    joints = zip(begin_rad, approach.poses_rad[-1], limits.lower_rad, limits.upper_rad, strict=False)
    for number, (q, ready, low, high) in enumerate(joints, start=1):
        nearer = q - copysign(tau, q - ready)
        if abs(q - ready) > pi and (low <= nearer <= high or not low <= q <= high):
            problem = f"joint {number} reads {q:.4f} rad, more than half a turn from the ready pose, {ready:.4f} rad"
            remedy = "check whether its encoder has lost a turn, or move it closer by hand"
            raise DeviceError("joint encoder", f"{problem}: {remedy}")


def withdrawal(approach: ReadyPosePath, begin_rad: JointVector) -> list[JointVector]:
    """Return the joint poses, one per tick, that withdraw a tool along its axis until it is clear of the plate.

    The list is empty if the tip is already clear, or if the tool is not aligned with the hole.

    Raises:
        DeviceError: The arm cannot withdraw the tool from its current pose.
    """
    kinematics = Kinematics(approach.arm, approach.tool)
    kinematics.update(begin_rad)
    tip = kinematics.tip_in_base
    height_m = -float(approach.goal_in_base.actInv(tip).translation[2])
    if height_m >= approach.clear_m or approach.goal_in_base.rotation[:, 2] @ tip.rotation[:, 2] < _ALONG:
        return []
    inverse, axis = InverseKinematics(kinematics, 1.0 / CONTROL_RATE_HZ), tip.rotation[:, 2]
    length_m = approach.clear_m - height_m
    ticks = max(1, round(length_m / WITHDRAWAL_M_S * CONTROL_RATE_HZ))
    q_rad, path = begin_rad, []
    for tick in range(1, ticks + 1):
        q_rad, limited = inverse.step(q_rad, pin.SE3(tip.rotation, tip.translation - length_m * tick / ticks * axis))
        if limited:
            raise DeviceError("rig", "the tool cannot be retracted from its position: move it by hand")
        path.append(q_rad)
    return path


def _joint_line(begin_rad: JointVector, target_rad: JointVector, speed_rad_s: float) -> list[JointVector]:
    """Return a straight joint-space path with constant acceleration; all joints arrive together."""
    begin, path_rad = np.array(begin_rad), np.subtract(target_rad, begin_rad)
    ticks = max(1, round(float(np.abs(path_rad).max()) / speed_rad_s * CONTROL_RATE_HZ))
    steps = np.convolve(np.full(ticks, 1.0 / ticks), np.full(_RAMP_TICKS, 1.0 / _RAMP_TICKS))
    return [*(tuple((begin + share * path_rad).tolist()) for share in np.cumsum(steps)[:-1]), target_rad]


def _follow(ticks: GuardedTicks, path: list[JointVector]) -> None:
    """Command one pose per tick and wait until the arm is stationary at the last one."""
    near, sequence, away = 0, -1, 0.0
    for pose in path:
        ticks.tick(pose)
    for _ in range(_TIMEOUT_TICKS):
        joints = ticks.tick(pose).joints
        away = max(abs(t - q) for t, q in zip(pose, joints.position_rad, strict=True))
        if joints.sequence != sequence:
            sequence, near = joints.sequence, near + 1 if away <= _THERE_RAD else 0
        if near == _STAYS_SAMPLES:
            return
    raise DeviceError("rig", f"the arm does not arrive at the ready pose: {away:.4f} rad away")


APPROACH_HEIGHT_M: Final = 0.1
"""Height above the plate that an arm passes on its way to the ready pose."""


def find_approach(config: RunConfig, ready: ReadyPose) -> ReadyPosePath:
    """Return a path from any pose to the ready pose: clear of the plate, to a point well above it, then down.

    Raises:
        UnreachableError: The arm cannot reach these poses.
    """
    inverse = InverseKinematics(Kinematics(arm_named(config.arm), config.tool.geometry), PERIOD_S)
    goal = goal_in_base(config.task.goal)
    above = goal.act(np.array([0.0, 0.0, -APPROACH_HEIGHT_M]))
    q = inverse.solve(pin.SE3(ready.tip_rotation, above), free_yaw=False, seed_rad=ready.q_rad, field="place")
    poses = tuple(q.tolist()), tuple(ready.q_rad.tolist())
    return ReadyPosePath(arm_named(config.arm), config.tool.geometry, goal, config.task.ready_height_mm * 1e-3, poses)
