"""Forward kinematics for the controller's arms, from the manufacturer's Denavit-Hartenberg tables."""

from collections.abc import Sequence
from math import cos, pi, sin
from typing import Final

import numpy as np
import pinocchio as pin

LENGTHS_M: Final = {
    "ur3": (-0.24365, -0.21325, 0.1519, 0.11235, 0.08535, 0.0819),
    "ur5": (-0.425, -0.39225, 0.089159, 0.10915, 0.09465, 0.0823),
    "ur10": (-0.612, -0.5723, 0.1273, 0.163941, 0.1157, 0.0922),
    "ur3e": (-0.24355, -0.2132, 0.15185, 0.13105, 0.08535, 0.0921),
    "ur5e": (-0.425, -0.3922, 0.1625, 0.1333, 0.0997, 0.0996),
    "ur10e": (-0.6127, -0.57155, 0.1807, 0.17415, 0.11985, 0.11655),
    "ur16e": (-0.4784, -0.36, 0.1807, 0.17415, 0.11985, 0.11655),
    "ur20": (-0.862, -0.7287, 0.2363, 0.201, 0.1593, 0.1543),
}
"""Lengths a2, a3, d1, d4, d5, d6. FACT: Universal Robots, parameters for kinematics and dynamics calculations."""
_ALPHA: Final = (pi / 2, 0.0, 0.0, pi / 2, -pi / 2, 0.0)


def tool_pose(arm: str, joints_rad: Sequence[float], offset: Sequence[float]) -> tuple[float, ...]:
    """Return the tool centre point, offset from the flange, in the controller's base: m and rotation vector, (6,)."""
    a2, a3, d1, d4, d5, d6 = LENGTHS_M[arm]
    at = np.eye(4)
    rows = zip(joints_rad, (d1, 0.0, 0.0, d4, d5, d6), (0.0, a2, a3, 0.0, 0.0, 0.0), _ALPHA, strict=True)
    for theta, d, a, alpha in rows:
        c, s, ca, sa = cos(theta), sin(theta), cos(alpha), sin(alpha)
        link = ((c, -s * ca, s * sa, a * c), (s, c * ca, -c * sa, a * s), (0.0, sa, ca, d), (0.0, 0.0, 0.0, 1.0))
        at = at @ np.array(link)
    place = at[:3, 3] + at[:3, :3] @ np.array(offset[:3])
    turn = at[:3, :3] @ pin.exp3(np.array(offset[3:]))
    return tuple(float(value) for value in (*place, *pin.log3(turn)))
