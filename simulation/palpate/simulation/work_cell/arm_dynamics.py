"""Body inertias and servos for a simulated arm whose description does not contain them."""

from math import hypot, isfinite, pi
from typing import Final

import numpy as np
import pinocchio as pin

from palpate.core.motion import ArmDescription, Kinematics, ToolGeometry, arm_named

_DENSITY_KG_M3: Final = 1200.0
"""Capsule density that approximates published arms: castings, motors and gears in half a shell."""
_RADIUS_M: Final = 0.04
_SLENDER: Final = 7.0
"""Ratio of a body's length to its radius, which is never less than a wrist's."""
_STIFFNESS_NM_PER_RAD: Final = (2e4, 4e3)
_ARMATURE_KG_M2: Final = (2.0, 0.4)
"""Joint armature for arms up to 30 kg; the second value is for the last three joints. Assumed."""
_SUPPORTED: Final = 3.0
"""Maximum ratio of inertia to armature without servo oscillation; of palpate's arms, only ur20 exceeds it."""


def body_inertias(kinematics: Kinematics) -> tuple[list[pin.Inertia], list[str]]:
    """Return the inertia of each moving body, base first, and the joints whose inertias were estimated."""
    model, found, estimated = kinematics.model, list[pin.Inertia](), list[str]()
    flange = model.frames[model.getFrameId("sensor")].placement
    for index in range(1, model.njoints):
        inertia = model.inertias[index]
        if not _is_physical(inertia):
            estimated.append(model.names[index])
            inertia = _capsule(inertia, (model.jointPlacements[index + 1 : index + 2] or [flange])[0].translation)
        found.append(inertia)
    return found, estimated


def inertia_lines(named: str | ArmDescription) -> list[str]:
    """Return a line for the user about estimated inertias, or an empty list if there are none."""
    _, estimated = body_inertias(Kinematics(arm_named(named), ToolGeometry()))
    if not estimated:
        return []
    return [f"the URDF has no mass or inertia of what {', '.join(estimated)} move: estimated as those of capsules"]


def servos(kinematics: Kinematics, inertias: list[pin.Inertia]) -> tuple[list[float], list[float]]:
    """Return the stiffness and armature for each joint's servo, from the description or scaled to the arm's inertia.

    Both scale with the inertia at the joint in the arm's posture, to keep the natural frequency and damping constant.
    """
    model, arm = kinematics.model.copy(), kinematics.arm
    for index, inertia in enumerate(inertias, start=1):
        model.inertias[index] = inertia
    moved = pin.crba(model, model.createData(), np.array(arm.posture_rad)).diagonal().tolist()
    is_wrist = [joint >= kinematics.joints - 3 for joint in range(kinematics.joints)]
    scale = [max(1.0, m / (_SUPPORTED * _ARMATURE_KG_M2[wrist])) for m, wrist in zip(moved, is_wrist, strict=True)]
    stiffness = [s * _STIFFNESS_NM_PER_RAD[wrist] for s, wrist in zip(scale, is_wrist, strict=True)]
    armature = [s * _ARMATURE_KG_M2[wrist] for s, wrist in zip(scale, is_wrist, strict=True)]
    return list(arm.servo_stiffness_Nm_per_rad) or stiffness, list(arm.servo_armature_kg_m2) or armature


def _is_physical(inertia: pin.Inertia) -> bool:
    is_finite = bool(np.isfinite(inertia.inertia).all()) and isfinite(inertia.mass)
    return is_finite and inertia.mass > 0.0 and bool(np.linalg.eigvalsh(inertia.inertia)[0] > 0.0)


def _capsule(given: pin.Inertia, end_m: np.ndarray) -> pin.Inertia:
    """Return the inertia of a capsule between two joints, with the given mass and centre if there is a mass."""
    length = hypot(*end_m)
    radius = max(_RADIUS_M, length / _SLENDER)
    is_given = isfinite(given.mass) and given.mass > 0.0
    mass = given.mass if is_given else _DENSITY_KG_M3 * pi * radius**2 * (length + 4.0 / 3.0 * radius)
    turn = pin.Quaternion.FromTwoVectors(np.array([0.0, 0.0, 1.0]), end_m) if length else pin.Quaternion.Identity()
    is_placed = is_given and np.isfinite(given.lever).all()
    centre = given.lever if is_placed else 0.5 * end_m
    return pin.Inertia.FromCapsule(mass, radius, length).se3Action(pin.SE3(turn.matrix(), centre))
