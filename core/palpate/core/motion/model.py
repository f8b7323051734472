"""Kinematics and frames: forward kinematics and Jacobian with Pinocchio, and transforms between fixed frames.

The transforms use plain floats, which are faster than calls to Pinocchio for single vectors.

Frames: *base* is the arm's root; *sensor* is on the flange, z along the tool axis out of the tool; *tip* is the centre
of the peg's end face, z along the peg. *Task* has its origin at the nominal goal (the assumed centre of the hole's
mouth), z into the hole, x along the x axis of *base*. Motion into the hole is +z, and pressing on the plate gives a
negative Fz.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache, partial
from math import hypot, inf, sqrt
from operator import mul
from pathlib import Path
from struct import Struct
from typing import Final, TypeAlias

import numpy as np
import numpy.typing as npt
import pinocchio as pin

from palpate.core.errors import AssetError, ConfigurationError
from palpate.core.motion.arm import ArmDescription
from palpate.core.motion.tool import ToolGeometry
from palpate.core.motion.urdf import prepared_urdf
from palpate.core.ports import JointVector, Vector3


@dataclass(frozen=True)
class _Loaded:
    """Pinocchio's model of the joints up to the flange, with the others fixed at zero, and the URDF's frames."""

    model: pin.Model
    flange: pin.Frame
    controller_base: pin.SE3
    controller_flange: pin.Frame


def controller_frames(arm: ArmDescription, q_rad: Sequence[float]) -> tuple[pin.SE3, pin.SE3]:
    """Return the placements of the controller's base and flange in the arm's root frame for joint angles (n,).

    These are the links ``base`` and ``tool0`` in ROS descriptions of industrial arms; if they are missing, the root and
    the flange are used.
    """
    loaded = _loaded(arm)
    data = loaded.model.createData()
    pin.forwardKinematics(loaded.model, data, np.array(q_rad))
    frame = loaded.controller_flange
    return loaded.controller_base.copy(), data.oMi[frame.parentJoint] * frame.placement


def _loaded(arm: ArmDescription) -> _Loaded:
    path = arm.find_urdf()
    try:
        return _parsed(arm, path, path.read_bytes(), Path(arm.calibration).read_bytes() if arm.calibration else b"")
    except OSError as error:
        what = "calibration" if error.filename == arm.calibration else "URDF"
        raise AssetError("arm", str(error.filename or path), f"no readable {what} ({error.strerror})") from error


# The key is the content of the files: a changed file is read again.
@lru_cache(maxsize=8)
def _parsed(arm: ArmDescription, path: Path, content: bytes, calibration: bytes) -> _Loaded:
    text, moving = prepared_urdf(arm, path, content, calibration)
    try:
        model = pin.buildModelFromXML(text)
        others = [index for index in range(1, model.njoints) if model.names[index] not in moving]
        if others:
            model = pin.buildReducedModel(model, others, pin.neutral(model))
    except (ValueError, RuntimeError) as error:
        raise AssetError("arm", str(path), f"no readable URDF ({' '.join(str(error).split())})") from error

    links = {frame.name: frame for frame in model.frames if frame.type == pin.FrameType.BODY}
    flange = links[arm.flange]
    base, tool = links.get("base"), links.get("tool0", flange)
    in_base = base.placement if base is not None and base.parentJoint == 0 else pin.SE3.Identity()
    return _Loaded(model, flange, in_base, tool if tool.parentJoint == flange.parentJoint else flange)


Array: TypeAlias = npt.NDArray[np.float64]

_LOCAL: Final = pin.ReferenceFrame.LOCAL
FASTEST_RAD_S: Final = 6.9
"""Velocity limit for joints that could move faster. A tick's step then stays below the supervisor's maximum limit for
a command jump, 50 mrad, and no task needs more."""


class Kinematics:
    """An arm with its tool. It contains Pinocchio's mutable data, so each caller needs its own instance.

    Attributes:
        model: Pinocchio's model, with the operational frames ``sensor`` and ``tip`` added.
        lower_rad: Lower joint limits, (n,).
        upper_rad: Upper joint limits, (n,).
        velocity_limit_rad_s: Joint velocity limits, (n,), at most :data:`FASTEST_RAD_S`.
        tip_position_m: Tip position in the base frame, (3,); a view that is refreshed by ``update``.
        tip_rotation: Rotation from tip frame to base frame, (3, 3); also a view.
        tip_in_sensor: Tip frame placement in the sensor frame.

    Raises:
        AssetError: The URDF is missing or cannot be read, has no such flange, or does not move it with six or seven
            revolute joints.
        ConfigurationError: Posture or limits do not match these joints.
    """

    def __init__(self, arm: ArmDescription, tool: ToolGeometry) -> None:
        self.arm, self.tool = arm, tool
        loaded = _loaded(arm)
        self.model, flange = loaded.model.copy(), loaded.flange
        # Columns are the tool's axes in the flange; permuting them cyclically keeps the frame right-handed.
        axes = np.roll(np.eye(3), "zxy".index(arm.tool_axis), axis=0)
        sensor, tip = _placement(tool.sensor_m, tool.sensor_rpy_rad), _placement(tool.tip_m, tool.tip_rpy_rad)
        self.tip_in_sensor: pin.SE3 = tip
        turned = pin.SE3(axes, np.zeros(3))
        self._sensor_id = self._add_frame("sensor", flange, turned * sensor)
        self._tip_id = self._add_frame("tip", flange, turned * (sensor * tip))
        self._data = self.model.createData()
        self._tip = self._data.oMf[self._tip_id]
        # Views of Pinocchio's memory: fetching them again costs more than the kinematics itself.
        self.tip_position_m: Array = self._tip.translation
        self.tip_rotation: Array = self._tip.rotation
        self.joints = int(self.model.nq)
        self._q: Array = np.zeros(self.joints)
        # An assignment of a tuple takes three times as long.
        self._set_q = partial(Struct(f"{self.joints}d").pack_into, self._q.data, 0)
        self.lower_rad: Array = np.array(self.model.lowerPositionLimit)
        self.upper_rad: Array = np.array(self.model.upperPositionLimit)
        self.velocity_limit_rad_s: Array = np.minimum(self.model.velocityLimit, FASTEST_RAD_S)
        self._require_limits()

    def _require_limits(self) -> None:
        arm, names = self.arm, list(self.model.names)[1:]
        limits = (each.tolist() for each in (self.lower_rad, self.upper_rad, self.velocity_limit_rad_s))
        rows = zip(names, arm.posture_rad, *limits, strict=True)
        for number, (name, posture, low, high, speed) in enumerate(rows):
            if not low < high:
                raise ConfigurationError("arm.lower_rad", low, f"less than upper_rad = {high:g} at joint {name}")
            if not 0.0 < speed < inf:
                raise ConfigurationError("arm.velocity_limit_rad_s", speed, f"a speed above 0 for joint {name}")
            if not low <= posture <= high:
                accepted = f"an angle from {low:g} to {high:g}, the limits of joint {name}"
                raise ConfigurationError(f"arm.posture_rad[{number}]", posture, accepted)

    def _add_frame(self, name: str, flange: pin.Frame, offset: pin.SE3) -> int:
        frame = pin.Frame(name, flange.parentJoint, flange.placement * offset, pin.FrameType.OP_FRAME)
        return int(self.model.addFrame(frame))

    def update(self, q_rad: JointVector | Array) -> None:
        """Compute the forward kinematics for joint angles (n,); all placements then refer to these angles."""
        self._set_q(*q_rad)
        pin.framesForwardKinematics(self.model, self._data, self._q)

    @property
    def tip_in_base(self) -> pin.SE3:
        """Return a copy of the tip frame's placement in the base frame."""
        return self._tip.copy()

    def tip_in(self, frame_in_base: pin.SE3) -> pin.SE3:
        """Return the tip frame's placement in a given frame."""
        return frame_in_base.actInv(self._tip)

    @property
    def sensor_in_base(self) -> pin.SE3:
        """Return a copy of the sensor frame's placement in the base frame."""
        return self._data.oMf[self._sensor_id].copy()

    def tip_jacobian(self, q_rad: JointVector | Array) -> Array:
        """Return the tip's Jacobian, (6, n), from joint velocities to its twist (linear first), in the tip frame.

        This also performs ``update`` and takes only slightly longer.
        """
        self._set_q(*q_rad)
        pin.computeJointJacobians(self.model, self._data, self._q)
        # This also places the tip.
        jacobian: Array = pin.getFrameJacobian(self.model, self._data, self._tip_id, _LOCAL)
        return jacobian

    def depth_step_m(self) -> float:
        """Return the standard deviation of the tip along the tool due to encoder steps, in the initial posture."""
        along: list[float] = self.tip_jacobian(self.arm.posture_rad)[2].tolist()
        return hypot(*map(mul, along, self.arm.encoder_step_rad)) / sqrt(12.0)

    def tip_error(self, target_in_base: pin.SE3) -> Array:
        """Return the twist that moves the tip to a placement in unit time, (6,), linear first, in the tip frame."""
        error: Array = pin.log6(self._tip.actInv(target_in_base)).vector
        return error


def _placement(position_m: Vector3, rpy_rad: Vector3) -> pin.SE3:
    return pin.SE3(pin.rpy.rpyToMatrix(*rpy_rad), np.array(position_m))


def rotated(rotation: Sequence[Sequence[float]], vector: Vector3) -> Vector3:
    """Rotate a vector, (3,), by a row-major rotation matrix, (3, 3)."""
    (a, b, c), (d, e, f), (g, h, i) = rotation
    x, y, z = vector
    return a * x + b * y + c * z, d * x + e * y + f * z, g * x + h * y + i * z


class FixedFrame:
    """A fixed frame that transforms points and vectors, (3,), to and from the base frame."""

    def __init__(self, in_base: pin.SE3) -> None:
        self._origin_m: list[float] = in_base.translation.tolist()
        self._to_base: list[list[float]] = in_base.rotation.tolist()
        self._from_base: list[list[float]] = in_base.rotation.T.tolist()

    def place_m(self, in_base_m: Sequence[float]) -> Vector3:
        """Convert a point from the base frame to this frame."""
        (x, y, z), (u, v, w) = in_base_m, self._origin_m
        return rotated(self._from_base, (x - u, y - v, z - w))

    def axis_in_base(self, axis: int) -> Vector3:
        """Return the unit vector along one of this frame's axes, in the base frame."""
        x, y, z = self._from_base[axis]
        return x, y, z

    def vector(self, in_base: Vector3) -> Vector3:
        """Convert a vector from the base frame to this frame."""
        return rotated(self._from_base, in_base)

    def vector_of(self, rotation_in_base: Sequence[Sequence[float]], vector: Vector3) -> Vector3:
        """Convert a vector to this frame from a frame with a given orientation in the base frame, (3, 3)."""
        return rotated(self._from_base, rotated(rotation_in_base, vector))

    def place_in_base_m(self, place_m: Vector3) -> Vector3:
        """Convert a point from this frame to the base frame."""
        (x, y, z), (u, v, w) = rotated(self._to_base, place_m), self._origin_m
        return x + u, y + v, z + w


def wrench_about(force_N: Vector3, torque_Nm: Vector3, point_m: Vector3) -> Vector3:
    """Return a wrench's torque about a new reference point, (3,): tau - point x force, all in the same frame.

    Args:
        force_N: The force, (3,).
        torque_Nm: Torque about the origin, (3,).
        point_m: The new reference point, relative to the origin, (3,).
    """
    fx, fy, fz = force_N
    tx, ty, tz = torque_Nm
    px, py, pz = point_m
    return tx - (py * fz - pz * fy), ty - (pz * fx - px * fz), tz - (px * fy - py * fx)
