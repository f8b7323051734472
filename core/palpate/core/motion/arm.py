"""Arm descriptions: URDF, resolution, servos, and an initial posture."""

import sys
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from importlib.metadata import entry_points
from math import pi
from pathlib import Path
from typing import Annotated, Any, ClassVar, Final, TypeAlias

from typing_extensions import override

from palpate.core.errors import AssetError, ConfigurationError, did_you_mean
from palpate.core.ports import Holds, OneOf, Range, Settings, kinds_of

GROUP: Final = "palpate.arms"
"""Entry point group for other packages; an entry maps a name for ``--arm`` to an :class:`ArmDescription`."""

_ROBOT_DATA: Final = "package://example-robot-data/"
_OURS: Final = "package://palpate/"
_COUNTS: Final = 131_072

_AboveZero: TypeAlias = Annotated[float, Range(0.0, above=True)]


@dataclass(frozen=True)
class ArmDescription(Settings):
    """An arm with six or seven revolute joints. Its URDF is the only source of geometry for Pinocchio and MuJoCo.

    Vectors have one element per joint, (n,), from base to flange.
    """

    TABLE: ClassVar[str] = "arm"

    urdf: Annotated[str, Holds(bool, "the path of a URDF")]
    """Path to the URDF, relative to the file that names it, or package://example-robot-data/... for a URDF in that
    package. Its meshes are not needed."""
    flange: Annotated[str, Holds(bool, "the name of a link of the URDF")]
    """URDF link that carries the force sensor."""
    posture_rad: tuple[float, ...]
    """Initial posture for the inverse kinematics, with the elbow bent; a redundant arm is pulled towards it."""
    name: str = ""
    """Name for logs and messages; empty uses the URDF's file name."""
    tool_axis: Annotated[str, OneOf("x", "y", "z")] = "z"
    """Flange axis that points out of the arm."""
    encoder_step_rad: tuple[_AboveZero, ...] = ()
    """Joint angle per encoder count; empty assumes 131 072 counts per turn."""
    lower_rad: tuple[float, ...] = ()
    """Lower joint limits that replace those in the URDF; required if it has none, as for a continuous joint."""
    upper_rad: tuple[float, ...] = ()
    """Upper joint limits, under the same conditions."""
    velocity_limit_rad_s: tuple[_AboveZero, ...] = ()
    """Joint velocity limits, under the same conditions."""
    calibration: str = ""
    """Path to the kinematic calibration saved by Universal Robots' ROS 2 driver, relative to the file that names it;
    empty uses the URDF's nominal kinematics."""
    servo_stiffness_Nm_per_rad: tuple[_AboveZero, ...] = ()
    """Simulated joint servo stiffness; empty assumes 4e3 for the last three joints and 2e4 for the others, and
    more for an arm above 30 kg."""
    servo_armature_kg_m2: tuple[_AboveZero, ...] = ()
    """Simulated motor inertia at the joint; empty assumes 0.4 for the last three joints and 2 for the others, and more
    for an arm above 30 kg."""
    evidence: str = ""
    """Source of the figures, with a note on which are assumed."""

    @override
    def check(self) -> None:
        joints = len(self.posture_rad)
        self.require("posture_rad", joints in (6, 7), "6 or 7 numbers, one per joint")
        for field, value in (("name", Path(self.urdf).stem), ("encoder_step_rad", (2 * pi / _COUNTS,) * joints)):
            if not getattr(self, field):
                object.__setattr__(self, field, value)
        servos = ("servo_stiffness_Nm_per_rad", "servo_armature_kg_m2")
        for field in ("encoder_step_rad", *servos, "lower_rad", "upper_rad", "velocity_limit_rad_s"):
            accepted = f"{joints} numbers, one per joint as in posture_rad"
            self.require(field, len(getattr(self, field)) in (0, joints), accepted)

    def __str__(self) -> str:
        """Return the name."""
        return self.name

    def find_urdf(self) -> Path:
        """Return the path to the URDF.

        Raises:
            AssetError: The URDF's package is not installed, or is not supported.
        """
        if self.urdf.startswith(_OURS):
            return Path(__file__).parent / self.urdf.removeprefix(_OURS)
        if not self.urdf.startswith(_ROBOT_DATA):
            if self.urdf.startswith("package://"):
                raise AssetError("arm", self.urdf, f"no path, and not in {_ROBOT_DATA}")
            return Path(self.urdf)
        # The PyPI package installs files under the environment's cmeel prefix, without a Python module to find them.
        relative = Path("cmeel.prefix/share/example-robot-data/robots") / self.urdf.removeprefix(_ROBOT_DATA)
        for folder in sys.path:
            candidate = Path(folder) / relative
            if candidate.is_file():
                return candidate
        raise AssetError(
            "arm",
            self.name,
            f"no {relative} on sys.path; install the PyPI package example-robot-data",
        )


def _of_robot_data(name: str, urdf: str, flange: str, *posture_rad: float, tool_axis: str = "z") -> ArmDescription:
    return ArmDescription(
        urdf=_ROBOT_DATA + urdf,
        flange=flange,
        posture_rad=posture_rad,
        name=name,
        tool_axis=tool_axis,
        evidence="geometry and limits: example-robot-data; encoder step, servo stiffness and armature: assumed",
    )


_UR: Final = "ur_description/urdf"
_UR_POSTURE: Final = (0.0, -1.6, 2.0, -1.97, -1.57, 0.0)


def _of_ur(name: str) -> ArmDescription:
    return ArmDescription(
        urdf=f"{_OURS}ur/{name}.urdf",
        flange="tool0",
        posture_rad=_UR_POSTURE,
        name=name,
        evidence="nominal kinematics, limits, masses: Universal_Robots_ROS2_Description of Universal Robots, commit"
        " 2221ec0f, BSD-3-Clause; encoder step and servos: assumed",
    )


ZEBRA_ZERO: Final = ArmDescription(
    name="zebra-zero",
    urdf=_OURS + "zebra_zero.urdf",
    flange="flange",
    posture_rad=(0.0, 1.17, -1.42, 0.0, 0.55, 0.0),
    # 192 000 counts per turn on joints 1 to 3; the wrist base ratio of 69 332 is used for the coupled wrist joints.
    encoder_step_rad=(2 * pi / 192_000,) * 3 + (2 * pi / 69_332,) * 3,
    evidence="geometry and counts: public ROS 2 port of the arm; servo stiffness, armature and masses: assumed",
)

ARMS: Final[dict[str, ArmDescription]] = {
    arm.name: arm
    for arm in (
        ZEBRA_ZERO,
        _of_robot_data("ur3", f"{_UR}/ur3_robot.urdf", "tool0", *_UR_POSTURE),
        _of_robot_data("ur5", f"{_UR}/ur5_robot.urdf", "tool0", *_UR_POSTURE),
        _of_robot_data("ur10", f"{_UR}/ur10_robot.urdf", "tool0", *_UR_POSTURE),
        *map(_of_ur, ("ur3e", "ur5e", "ur10e", "ur16e", "ur20")),
        _of_robot_data("panda", "panda_description/urdf/panda.urdf", "panda_link8", 0.0, 0.1, 0.0, -2.7, 0.0, 2.8, 0.0),
        _of_robot_data("z1", "z1_description/urdf/z1.urdf", "link06", 0.0, 2.1, -1.5, 0.97, 0.0, 0.0, tool_axis="x"),
        _of_robot_data("xarm7", "xarm_description/urdf/xarm7.urdf", "link_eef", 0.0, 0.1, 0.0, 0.65, 0.0, 0.55, 0.0),
    )
}


def arm_of_table(table: Mapping[str, Any]) -> str | dict[str, Any]:
    """Convert an ``[arm]`` table to a setting: the name alone, or the named arm with changes from other keys.

    Raises:
        ConfigurationError: No arm has that name.
    """
    known = kinds_of(ArmDescription)
    for key, value in table.items():
        if key not in known:
            hint = did_you_mean(f"arm.{key}", [f"arm.{each}" for each in known])
            raise ConfigurationError(f"arm.{key}", value, f"no such field{hint} (known here: {', '.join(known)})")
    if "urdf" in table:
        return dict(table)
    name = table.get("name")
    if not isinstance(name, str):
        raise ConfigurationError("arm.name", name, f"one of {', '.join(ARMS)}, or a table [arm] with urdf and flange")
    return name if len(table) == 1 else {**asdict(arm_named(name)), **table}


def arm_named(arm: str | ArmDescription) -> ArmDescription:
    """Return the arm with a given name, from palpate or another package; a description is returned unchanged.

    Raises:
        ConfigurationError: No arm has that name, or its package cannot be loaded.
    """
    if isinstance(arm, ArmDescription):
        return arm
    if arm in ARMS:
        return ARMS[arm]
    others = entry_points(group=GROUP)
    for entry in others:
        if entry.name == arm:
            try:
                found = entry.load()
            except Exception as error:
                # Importing a third-party package may fail in any way.
                accepted = f"an arm that can be loaded; {entry.value} cannot ({error})"
                raise ConfigurationError("arm", arm, accepted) from error
            if not isinstance(found, ArmDescription):
                raise ConfigurationError("arm", arm, f"an ArmDescription at {entry.value}")
            return found
    known = ", ".join([*ARMS, *sorted(entry.name for entry in others)])
    raise ConfigurationError("arm", arm, f"one of {known}, or a table [arm] with urdf, flange and posture_rad")
