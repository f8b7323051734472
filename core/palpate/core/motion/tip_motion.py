"""Convert tip velocities in the task frame to joint commands, and parametrise orientations.

An orientation relative to the upright tool consists of tilt about x and y and yaw about z in the task frame. The yaw is
applied before the tilt, so the tilt is that of the tool axis at any yaw.
"""

from functools import partial
from math import atan2, cos, hypot, isfinite, radians, sin
from struct import Struct
from typing import Final, TypeAlias

import numpy as np
import pinocchio as pin

from palpate.core.motion.controllers import limited
from palpate.core.motion.inverse import InverseKinematics
from palpate.core.motion.model import Array, FixedFrame, Kinematics, rotated
from palpate.core.ports import AppliedCommand, CommandReason, JointCommand, JointVector, Vector3

Rows: TypeAlias = tuple[Vector3, Vector3, Vector3]


def tilt_rows(turn_rad: Vector3) -> Rows:
    """Return the rotation due to the tilt alone, as a row-major (3, 3) matrix in the task frame."""
    x, y, _ = turn_rad
    # Without a tilt the direction is arbitrary; avoid dividing by zero.
    angle = max(hypot(x, y), 1e-300)
    x, y, s = x / angle, y / angle, sin(angle)
    c = cos(angle)
    d = 1.0 - c
    return (c + x * x * d, x * y * d, y * s), (x * y * d, c + y * y * d, -x * s), (-y * s, x * s, c)


def orientation(turn_rad: Vector3) -> Rows:
    """Return the rotation from upright to an orientation, as a row-major (3, 3) matrix in the task frame."""
    return _yawed(tilt_rows(turn_rad), turn_rad[2])


def _yawed(tilt: Rows, yaw_rad: float) -> Rows:
    (a, b, e), (f, g, h), (i, j, k) = tilt
    s, c = sin(yaw_rad), cos(yaw_rad)
    return (a * c + b * s, b * c - a * s, e), (f * c + g * s, g * c - f * s, h), (i * c + j * s, j * c - i * s, k)


def turn_of(rotation: Rows) -> Vector3:
    """Return the tilt and yaw of a rotation from upright, given as a row-major (3, 3) matrix in the task frame."""
    (a, _, e), (f, _, h), (i, _, k) = rotation
    share = atan2(hypot(e, h), k) / max(hypot(e, h), 1e-300)
    x, y = -h * share, e * share
    (p, q, _), (u, v, _), (r, w, _) = tilt_rows((x, y, 0.0))
    return x, y, atan2(q * a + v * f + w * i, p * a + u * f + r * i)


class AngularCompliance:
    """Rotational compliance: angular velocity = mobility x torque, like generalised damping for forces.

    Stability: with a contact of torsional stiffness K the torque is multiplied by 1 - K m T each tick. A peg between
    walls, in series with the gripper's springs, has about 15 N m/rad, so 3 rad/(N m s) is a third of the bound.

    Args:
        tilt_rad_per_Nms: Mobility about x and y.
        yaw_rad_per_Nms: Mobility about z.
        fastest_rad_s: Maximum angular speed.
    """

    def __init__(self, tilt_rad_per_Nms: float, yaw_rad_per_Nms: float, fastest_rad_s: float) -> None:
        self._tilt, self._yaw, self._fastest_rad_s = tilt_rad_per_Nms, yaw_rad_per_Nms, fastest_rad_s

    def rate_rad_s(self, torque_Nm: Vector3) -> Vector3:
        """Return the angular velocity, (3,), for a torque exerted by the environment, (3,), both in the task frame."""
        x, y, z = torque_Nm
        return limited((self._tilt * x, self._tilt * y, self._yaw * z), self._fastest_rad_s)


FASTEST_TURN_RAD_S: Final = radians(20.0)
"""Maximum angular speed of the reference; faster reactions to torque would oscillate between a hole's walls."""
FASTEST_JOINT_RAD_S: Final = 8e-3 / 20e-3
"""Maximum joint speed in a turn. An arm with a lag of 20 ms is then 8 mrad behind; the supervisor accepts 10 mrad."""


_NOWHERE: Final = np.zeros(3)
_UPRIGHT: Final = (0.0, 0.0, 0.0)
_UPRIGHT_RAD: Final = 8e-3
"""Error, for example from a sagging servo, below which a stationary tool counts as upright."""


class TipMotion:
    """The commanded tip, a reference moved by controllers, and the joint angles that follow it.

    The tool keeps its orientation unless :meth:`turn` is called.

    Args:
        kinematics: Kinematics for the commanded configuration; must not be shared with the measured one.
        tip_rotation_in_base: Upright tool orientation, (3, 3).

    Attributes:
        reference_m: Commanded tip, (3,), task frame.
        turn_rad: Commanded orientation relative to the upright tool, (3,): tilt about x and y, yaw about z, task frame.
        tilt: Rotation due to the tilt in ``turn_rad`` alone, as a row-major (3, 3) matrix in the task frame.
    """

    def __init__(
        self, kinematics: Kinematics, task_in_base: pin.SE3, tip_rotation_in_base: Array, period_s: float
    ) -> None:
        self._kinematics = kinematics
        self._inverse = InverseKinematics(kinematics, period_s)
        self._task = FixedFrame(task_in_base)
        self._target = pin.SE3(tip_rotation_in_base, _NOWHERE)
        self._set_target_m = partial(Struct("3d").pack_into, self._target.translation.data, 0)
        self._period_s = period_s
        self._upright: Array = np.array(tip_rotation_in_base)
        self._task_turn = pin.SE3(task_in_base.rotation, _NOWHERE)
        self._upright_turn = self._task_turn.inverse() * pin.SE3(self._upright, _NOWHERE)
        self._q_rad: JointVector
        self._joints_per_turn: list[Vector3]
        self.reference_m: Vector3

    def start(self, position_rad: JointVector) -> None:
        """Start from the arm's pose and the actual tool orientation; the tool may be rotated and wedged in a hole."""
        self._q_rad = position_rad
        self._kinematics.update(position_rad)
        self.reference_m = self._task.place_m(self._kinematics.tip_position_m.tolist())
        turned = self._task_turn.actInv(pin.SE3(self._kinematics.tip_rotation, _NOWHERE) * self._upright_turn.inverse())
        turn_rad = turn_of(turned.rotation.tolist())
        self._turn_to(turn_rad if hypot(*turn_rad) > _UPRIGHT_RAD else _UPRIGHT)
        self.look_at_joints()

    def look_at_joints(self) -> None:
        """Compute the joint speeds that turns require at the current pose."""
        self._kinematics.update(self._q_rad)
        to_tip = self._kinematics.tip_rotation.T.tolist()
        axes = [rotated(to_tip, self._task.axis_in_base(axis)) for axis in range(3)]
        self._joints_per_turn = list(zip(*(self._inverse.turning(self._q_rad, axis) for axis in axes), strict=True))

    def fastest_turn_rad_s(self, rate_rad_s: Vector3) -> float:
        """Return the maximum angular speed in a given direction, (3,), near the pose of :meth:`look_at_joints`."""
        x, y, z = rate_rad_s
        joint_rad_s = max(abs(a * x + b * y + c * z) for a, b, c in self._joints_per_turn)
        return min(FASTEST_TURN_RAD_S, FASTEST_JOINT_RAD_S * hypot(x, y, z) / max(joint_rad_s, 1e-12))

    def right(self, rate_rad_s: float) -> None:
        """Make the next :meth:`move` turn the reference towards upright, no faster than the given rate."""
        angle_rad = hypot(*self.turn_rad)
        if angle_rad <= rate_rad_s * self._period_s:
            self._turn_to(_UPRIGHT)
            return
        x, y, z = self.turn_rad
        share = -rate_rad_s / angle_rad
        self.turn((share * x, share * y, share * z))

    def adopt(self, applied: AppliedCommand) -> bool:
        """Continue from the applied command, so that limited commands do not cause wind-up.

        Returns:
            False if the applied command is invalid, because it is not finite or has the wrong number of joints.
        """
        if applied.reason is not CommandReason.AS_REQUESTED:
            if len(applied.position_rad) != len(self._q_rad) or not isfinite(sum(applied.position_rad)):
                return False
            self._q_rad = applied.position_rad
        return True

    def turn(self, rate_rad_s: Vector3) -> Vector3:
        """Make the next :meth:`move` also turn the reference.

        Args:
            rate_rad_s: Rate of change of ``turn_rad``, (3,).

        Returns:
            The angular velocity, limited to a speed that the joints can follow.
        """
        rate_rad_s = limited(rate_rad_s, self.fastest_turn_rad_s(rate_rad_s))
        self._rate_rad_s: Vector3 | None = rate_rad_s
        return rate_rad_s

    def _turn_to(self, turn_rad: Vector3) -> None:
        self.turn_rad, self.tilt, self._rate_rad_s = turn_rad, tilt_rows(turn_rad), None
        if turn_rad == _UPRIGHT:
            self._target.rotation = self._upright
            return
        # pin.SE3 multiplies without BLAS.
        turn = pin.SE3(np.array(_yawed(self.tilt, turn_rad[2])), _NOWHERE)
        self._target.rotation = (self._task_turn * turn * self._upright_turn).rotation

    def move(self, velocity_m_s: Vector3) -> JointCommand:
        """Advance the reference by one control period and move the joints to follow it.

        Args:
            velocity_m_s: Tip velocity, (3,), task frame.
        """
        period = self._period_s
        x, y, z = self.reference_m
        vx, vy, vz = velocity_m_s
        self.reference_m = reference = (x + vx * period, y + vy * period, z + vz * period)
        if self._rate_rad_s is not None:
            (a, b, c), (u, v, w), self._rate_rad_s = self.turn_rad, self._rate_rad_s, None
            self._turn_to((a + u * period, b + v * period, c + w * period))
        self._set_target_m(*self._task.place_in_base_m(reference))
        self._q_rad, _ = self._inverse.step(self._q_rad, self._target)
        return JointCommand(self._q_rad)
