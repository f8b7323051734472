"""Value objects that cross the ports: frozen, validated once, and named with units.

Vectors are tuples of floats, not arrays: they are immutable, are compared and hashed by value, keep all bits, and are
several times cheaper to create at 140 Hz than read-only arrays. Types without validation are named tuples, which take
a quarter as long to create as frozen dataclasses.
"""

import enum
from dataclasses import dataclass
from math import isfinite
from typing import Final, NamedTuple, TypeAlias

from palpate.core.errors import CommandError

CONTROL_RATE_HZ: Final = 140
"""Sampling rate used in the paper, an integer so that tick times are exact."""
PERIOD_S: Final = 1.0 / CONTROL_RATE_HZ

Vector3: TypeAlias = tuple[float, float, float]
JointVector: TypeAlias = tuple[float, ...]
ZERO_VELOCITY: Final[Vector3] = (0.0, 0.0, 0.0)
"""Zero velocity, or zero angular velocity."""


class Validity(enum.Enum):
    """A sample's validity; if several values apply, the worst one is used."""

    VALID = "valid"
    SATURATED = "saturated"
    STALE = "stale"
    INVALID = "invalid"


SENSOR_FRAME: Final = "sensor"
"""Name of the sensor frame, in which the task expects wrenches: z along the tool axis, out of the tool."""


class WrenchKind(enum.Enum):
    """Processing already applied to a wrench."""

    RAW = "raw"
    TARED = "tared"
    GRAVITY_COMPENSATED = "gravity compensated"


class CommandReason(enum.Enum):
    """Reason why the applied command differs from the requested one."""

    AS_REQUESTED = "as asked"
    POSITION_LIMIT = "joint position limit"
    VELOCITY_LIMIT = "joint velocity limit"
    STOPPED = "arm is stopped"


@dataclass(frozen=True, slots=True)
class WrenchSample:
    """A sensor sample: the wrench that the environment exerts on the tool.

    Attributes:
        force_N: Force, (3,), in ``frame``.
        torque_Nm: Torque about the origin of ``frame``, (3,), in ``frame``.
        source_time_ns: Run-clock time of the measurement.
        receive_time_ns: Run-clock time at which the host received the sample.
        sequence: Sample number from the device; equal numbers denote the same sample.
        validity: Validity of the sample.
        kind: Raw, tared or gravity-compensated.
        frame: Name of a right-handed frame, normally ``"sensor"``: z along the tool axis, out of
            the tool, so that pressing on a surface gives a negative ``force_N[2]``.

    The producer must mark a sample that is not finite as ``INVALID``.
    """

    force_N: Vector3
    torque_Nm: Vector3
    source_time_ns: int
    receive_time_ns: int
    sequence: int
    validity: Validity = Validity.VALID
    kind: WrenchKind = WrenchKind.RAW
    frame: str = SENSOR_FRAME

    def __post_init__(self) -> None:
        (fx, fy, fz), (tx, ty, tz) = self.force_N, self.torque_Nm
        if not isfinite(fx + fy + fz + tx + ty + tz) and self.validity is not Validity.INVALID:
            raise CommandError("a wrench that is not finite must be marked INVALID", (self.force_N, self.torque_Nm))


@dataclass(frozen=True, slots=True)
class JointSample:
    """An encoder sample: the joint angles.

    Attributes:
        position_rad: Joint angles, (n,), in the kinematic model's order. For the other fields, see
            :class:`WrenchSample`.
    """

    position_rad: JointVector
    source_time_ns: int
    receive_time_ns: int
    sequence: int
    validity: Validity = Validity.VALID

    def __post_init__(self) -> None:
        if not isfinite(sum(self.position_rad)) and self.validity is not Validity.INVALID:
            raise CommandError("joint angles that are not finite must be marked INVALID", self.position_rad)


@dataclass(frozen=True, slots=True)
class JointCommand:
    """Target joint angles for the servos, (n,) rad.

    Raises:
        CommandError: An angle is not finite.
    """

    position_rad: JointVector

    def __post_init__(self) -> None:
        if not isfinite(sum(self.position_rad)):
            raise CommandError("a joint command must be finite", self.position_rad)


class AppliedCommand(NamedTuple):
    """The command that the arm applied, and the reason for any difference from the requested one.

    Attributes:
        position_rad: Joint angles after limits, (n,).
        reason: ``AS_REQUESTED`` if and only if nothing changed.
    """

    position_rad: JointVector
    reason: CommandReason = CommandReason.AS_REQUESTED


class Snapshot(NamedTuple):
    """Everything that reaches the core in one control tick.

    Attributes:
        tick: Tick number in the trial, from 0.
        applied: The command applied in the previous tick; None at the first tick.
    """

    tick: int
    time_ns: int
    wrench: WrenchSample
    joints: JointSample
    applied: AppliedCommand | None = None
