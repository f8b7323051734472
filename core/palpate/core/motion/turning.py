"""Orientation of a tool against the upright one, as three numbers: how it leans about x and y, and its yaw about z.

The tool is turned by its yaw first and leans then, so that the lean is that of the tool's axis whatever the yaw. All of
it is about axes of the task frame.
"""

from math import cos, hypot, sin
from typing import TypeAlias

from palpate.core.motion.laws import limited
from palpate.core.ports import Vector3

Rows: TypeAlias = tuple[Vector3, Vector3, Vector3]


def leaning(turn_rad: Vector3) -> Rows:
    """Rotation by the lean alone, (3, 3), row by row, task frame."""
    x, y, _ = turn_rad
    # Upright it leans in no direction, but there is one to divide by.
    angle = max(hypot(x, y), 1e-300)
    x, y, s = x / angle, y / angle, sin(angle)
    c = cos(angle)
    d = 1.0 - c
    return (c + x * x * d, x * y * d, y * s), (x * y * d, c + y * y * d, -x * s), (-y * s, x * s, c)


def orientation(turn_rad: Vector3) -> Rows:
    """Rotation from the upright tool to the turned one, (3, 3), row by row, task frame."""
    lean, s, c = leaning(turn_rad), sin(turn_rad[2]), cos(turn_rad[2])
    (a, b, e), (f, g, h), (i, j, k) = lean
    return (a * c + b * s, b * c - a * s, e), (f * c + g * s, g * c - f * s, h), (i * c + j * s, j * c - i * s, k)


class GivingWay:
    """Turns with the torque: turn rate = mobility x torque, as generalised damping is for forces.

    Stability: against a contact of torsional stiffness K the torque shrinks by 1 - K m T each tick. A peg between
    walls, the gripper's springs in series, has some 15 N m/rad, so 3 rad/(N m s) leave it at a third of the bound.

    Args:
        tilt_rad_per_Nms: Mobility about x and y.
        yaw_rad_per_Nms: Mobility about z.
        fastest_rad_s: Highest turn rate.
    """

    def __init__(self, tilt_rad_per_Nms: float, yaw_rad_per_Nms: float, fastest_rad_s: float) -> None:
        self._tilt, self._yaw, self._fastest_rad_s = tilt_rad_per_Nms, yaw_rad_per_Nms, fastest_rad_s

    def rate_rad_s(self, torque_Nm: Vector3) -> Vector3:
        """Turn rate, (3,), for a torque of the environment on the tool, (3,), both task frame."""
        x, y, z = torque_Nm
        return limited((self._tilt * x, self._tilt * y, self._yaw * z), self._fastest_rad_s)
