"""What distinguishes one arm from another: its URDF, its resolution, its servos, and a posture to start from."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass
from math import pi
from pathlib import Path
from typing import Final

from palpate.core.errors import AssetError, ConfigurationError


@dataclass(frozen=True)
class ArmDescription:
    """One six-joint arm. The URDF is the only source of its geometry, for Pinocchio and MuJoCo alike.

    Attributes:
        name: What ``--arm`` takes.
        find_urdf: Gives the path of the URDF, or raises ``AssetError``.
        flange_frame: Name of the URDF frame that carries the sensor, z out of the arm.
        posture_rad: A comfortable elbow posture, (6,); inverse kinematics starts from it and so picks its branch.
        encoder_step_rad: Joint angle per encoder count, (6,).
        servo_stiffness_Nm_per_rad: Simulated joint servo stiffness, (6,).
        servo_armature_kg_m2: Simulated motor inertia seen at the joint, (6,).
        evidence: Where the figures come from, and which of them are assumed.
    """

    name: str
    find_urdf: Callable[[], Path]
    flange_frame: str
    posture_rad: tuple[float, ...]
    encoder_step_rad: tuple[float, ...]
    servo_stiffness_Nm_per_rad: tuple[float, ...]
    servo_armature_kg_m2: tuple[float, ...]
    evidence: str


def _own_urdf() -> Path:
    return Path(__file__).with_name("zebra_zero.urdf")


def _example_robot_data_urdf() -> Path:
    # The PyPI package ships files under the environment's cmeel prefix, and no Python module to ask for them.
    relative = Path("cmeel.prefix/share/example-robot-data/robots/ur_description/urdf/ur5_robot.urdf")
    for folder in sys.path:
        candidate = Path(folder) / relative
        if candidate.is_file():
            return candidate
    raise AssetError(
        "arm",
        "ur5",
        f"the PyPI package example-robot-data must be installed (looked for {relative} on sys.path)",
    )


ZEBRA_ZERO: Final = ArmDescription(
    name="zebra-zero",
    find_urdf=_own_urdf,
    flange_frame="flange",
    posture_rad=(0.0, 1.17, -1.42, 0.0, 0.55, 0.0),
    # 192 000 counts a turn on joints 1 to 3; the wrist base ratio of 69 332 stands for the coupled wrist joints.
    encoder_step_rad=(2 * pi / 192_000,) * 3 + (2 * pi / 69_332,) * 3,
    servo_stiffness_Nm_per_rad=(2e4, 2e4, 2e4, 4e3, 4e3, 4e3),
    servo_armature_kg_m2=(2.0, 2.0, 2.0, 0.4, 0.4, 0.4),
    evidence="geometry and counts: public ROS 2 port of the arm; servo stiffness, armature and masses: assumed",
)

UR5: Final = ArmDescription(
    name="ur5",
    find_urdf=_example_robot_data_urdf,
    flange_frame="tool0",
    posture_rad=(0.0, -1.6, 2.0, -1.97, -1.57, 0.0),
    encoder_step_rad=(2 * pi / 131_072,) * 6,
    servo_stiffness_Nm_per_rad=(2e4, 2e4, 2e4, 4e3, 4e3, 4e3),
    servo_armature_kg_m2=(2.0, 2.0, 2.0, 0.4, 0.4, 0.4),
    evidence="geometry and limits: example-robot-data; encoder step, servo stiffness and armature: assumed",
)

ARMS: Final[dict[str, ArmDescription]] = {arm.name: arm for arm in (ZEBRA_ZERO, UR5)}


def arm_named(name: str) -> ArmDescription:
    """The arm of that name.

    Raises:
        ConfigurationError: There is none.
    """
    if name not in ARMS:
        raise ConfigurationError("arm", name, f"one of {', '.join(ARMS)}")
    return ARMS[name]
