"""Compare the model of an arm and its tool with the tool pose and settings reported by the controller.

With a wrong or uncalibrated model, the arm moves to the wrong poses.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import hypot
from typing import Final

import numpy as np
import pinocchio as pin

from palpate.adapters.hardware.plugins import RigContext
from palpate.core.errors import ConfigurationError
from palpate.core.job import ToolConfig
from palpate.core.motion import ArmDescription, Kinematics, controller_frames

_CALIBRATED_MM, _CALIBRATED_MRAD = 1.0, 5.0
_NOMINAL_MM: Final = 10.0
"""Accepted deviation. Nominal lengths deviate by some millimetres; a different arm deviates by centimetres."""
_NOMINAL_MRAD: Final = 50.0
"""Rotation that moves a tip 0.2 m from the flange by the same 10 mm."""
_TIP_MM: Final = 1.0
_LIGHTER_KG, _HEAVIER_KG = 0.1, 2.0
"""Payload margins. The payload is the tool with the force sensor, which weighs up to 2 kg with its plates."""
_CENTRE_MM: Final = 30.0
"""Accepted deviation of the centre of mass, assumed to be halfway between the flange and the sensor frame."""


@dataclass(frozen=True, slots=True)
class ReportedPose:
    """Arm and tool data reported by a controller; poses are positions in m and rotation vectors, (6,).

    Attributes:
        tool_in_base: Tool centre point in the controller's base, at these joint angles.
        tool_on_flange: Tool centre point configured in the controller.
        payload_centre_m: Centre of mass of the payload relative to the flange, (3,).
    """

    q_rad: Sequence[float]
    tool_in_base: Sequence[float]
    tool_on_flange: Sequence[float]
    payload_kg: float
    payload_centre_m: Sequence[float]


def disagreement(arm: ArmDescription, reported: ReportedPose) -> tuple[float, float]:
    """Return the deviation of the model's flange pose from the reported one, in mm and mrad."""
    base, flange = controller_frames(arm, reported.q_rad)
    found = _placement(reported.tool_in_base) * _placement(reported.tool_on_flange).inverse()
    off = base.actInv(flange).actInv(found)
    return 1e3 * hypot(*off.translation), 1e3 * hypot(*pin.log3(off.rotation))


def judge_kinematics(context: RigContext, reported: ReportedPose) -> str:
    """Return a line that says whether the model and the controller agree.

    Raises:
        ConfigurationError: They do not agree, or the model is nominal and has not been accepted by a person.
    """
    arm = context.arm
    mm, mrad = disagreement(arm, reported)
    offset = f"{mm:.1f} mm and {mrad:.1f} mrad from the flange that the controller reports"
    most_mm, most_mrad = (_CALIBRATED_MM, _CALIBRATED_MRAD) if arm.calibration else (_NOMINAL_MM, _NOMINAL_MRAD)
    if not (mm <= most_mm and mrad <= most_mrad):
        accepted = f"the model of this arm, within {most_mm:g} mm and {most_mrad:g} mrad; its flange is {offset}"
        raise ConfigurationError("arm", arm.name, accepted)
    if arm.calibration:
        return f"the calibrated model of {arm.name} is {offset}"
    if not context.accept_kinematics:
        accepted = f"[arm] calibration = FILE, or --accept-kinematics: its nominal model is {offset}"
        raise ConfigurationError("arm", arm.name, accepted)
    return f"the nominal model of {arm.name} is {offset}; other poses may differ more, so set [arm] calibration = FILE"


def judge_tool(context: RigContext, tool: ToolConfig, reported: ReportedPose) -> str:
    """Return a line that says whether the tool and the controller agree.

    Raises:
        ConfigurationError: The controller has a different tool centre point or payload.
    """
    kinematics = Kinematics(context.arm, tool.geometry)
    kinematics.update(tuple(reported.q_rad))
    flange = controller_frames(context.arm, reported.q_rad)[1]
    tip, sensor = (flange.actInv(frame) for frame in (kinematics.tip_in_base, kinematics.sensor_in_base))
    entered, given = np.array(reported.tool_on_flange[:3]), 1e3 * tip.translation
    if entered.any() and not 1e3 * hypot(*(entered - tip.translation)) <= _TIP_MM:
        accepted = f"the tip at ({_mm(entered)}) mm from the flange, the tool centre point that the controller has"
        raise ConfigurationError("tool.tip_mm", f"{given.round(2).tolist()} mm from the flange", accepted)
    payload_kg, mass_kg = reported.payload_kg, tool.mass_kg
    fits = mass_kg - _LIGHTER_KG <= payload_kg <= mass_kg + _HEAVIER_KG
    accepted = f"a mass that fits the payload of {payload_kg:g} kg that the controller has, with the force sensor"
    tool.require("mass_kg", fits, accepted)
    own = sensor.act(np.array(tool.centre_of_mass_mm) * 1e-3) * mass_kg
    expected = (own + 0.5 * sensor.translation * max(0.0, payload_kg - mass_kg)) / max(payload_kg, mass_kg)
    centre_m = np.array(reported.payload_centre_m)
    accepted = f"one that fits the payload's centre at ({_mm(centre_m)}) mm from the flange, which the controller has"
    tool.require("centre_of_mass_mm", 1e3 * hypot(*(expected - centre_m)) <= _CENTRE_MM, accepted)
    return "payload of the controller and tool agree" + (
        "; it has no tool centre point" if not entered.any() else ", and so does its tool centre point"
    )


def _placement(pose: Sequence[float]) -> pin.SE3:
    return pin.SE3(pin.exp3(np.array(pose[3:])), np.array(pose[:3]))


def _mm(metres: np.ndarray) -> str:
    return ", ".join(f"{value * 1e3:.4g}" for value in metres)
