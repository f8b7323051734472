"""Value objects that cross the ports: frozen, validated once, units in the names.

Vectors are tuples of floats, not arrays: they are immutable for certain, compare and hash by value,
keep every bit, and are several times cheaper to make at 140 Hz than read-only arrays. What has nothing to be
validated is a named tuple, which takes a quarter of the time of a frozen dataclass to make.
"""

import enum
from dataclasses import dataclass
from math import isfinite
from typing import Final, NamedTuple, TypeAlias

from palpate.core.errors import CommandError

CONTROL_RATE_HZ: Final = 140
"""The paper's sampling rate; a whole number, so that tick times are exact."""
PERIOD_S: Final = 1.0 / CONTROL_RATE_HZ

Vector3: TypeAlias = tuple[float, float, float]
JointVector: TypeAlias = tuple[float, ...]
STILL: Final[Vector3] = (0.0, 0.0, 0.0)
"""The velocity, or the turn rate, of what does not move."""


class Validity(enum.Enum):
    """How far a sample may be trusted; the worst that applies."""

    VALID = "valid"
    SATURATED = "saturated"
    STALE = "stale"
    INVALID = "invalid"


SENSOR_FRAME: Final = "sensor"
"""Name of the frame of wrenches that the task works with: z along the tool axis, out of the tool."""


class WrenchKind(enum.Enum):
    """What has already been taken out of a wrench."""

    RAW = "raw"
    TARED = "tared"
    GRAVITY_COMPENSATED = "gravity compensated"


class CommandReason(enum.Enum):
    """Why the command that was applied is not the one that was asked for."""

    AS_ASKED = "as asked"
    POSITION_LIMIT = "joint position limit"
    VELOCITY_LIMIT = "joint velocity limit"
    STOPPED = "arm is stopped"


@dataclass(frozen=True, slots=True)
class WrenchSample:
    """Wrench that the environment exerts on the tool, as one sensor sample.

    Attributes:
        force_N: Force, (3,), in ``frame``.
        torque_Nm: Torque about the origin of ``frame``, (3,), in ``frame``.
        source_time_ns: Run-clock time at which the device measured.
        receive_time_ns: Run-clock time at which the host had the sample.
        sequence: Counts the device's samples; equal numbers mean the same sample.
        validity: How far to trust it.
        kind: Raw, tared or gravity-compensated.
        frame: Name of the right-handed frame, normally ``"sensor"``: z along the tool axis, out of
            the tool, so that pressing on a surface gives a negative ``force_N[2]``.

    A sample that is not finite must be marked ``INVALID`` by whoever makes it.
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
    """Joint angles from the encoders, as one sample.

    Attributes:
        position_rad: Joint angles, (n,), in the order of the kinematic model.
        source_time_ns: Run-clock time at which the device measured.
        receive_time_ns: Run-clock time at which the host had the sample.
        sequence: Counts the device's samples; equal numbers mean the same sample.
        validity: How far to trust it.
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
    """Joint angles that the arm's servos are to hold, (n,) rad.

    Raises:
        CommandError: An angle is not finite.
    """

    position_rad: JointVector

    def __post_init__(self) -> None:
        if not isfinite(sum(self.position_rad)):
            raise CommandError("a joint command must be finite", self.position_rad)


class AppliedCommand(NamedTuple):
    """What the arm was really told, and why it differs from what was asked.

    Attributes:
        position_rad: Joint angles after limits, (n,).
        reason: ``AS_ASKED`` exactly when nothing was changed.
    """

    position_rad: JointVector
    reason: CommandReason = CommandReason.AS_ASKED


class Snapshot(NamedTuple):
    """All that reaches the core in one control tick.

    Attributes:
        tick: Counts the ticks of a trial from 0.
        applied: What became of the command of the tick before; None on the first tick.
    """

    tick: int
    time_ns: int
    wrench: WrenchSample
    joints: JointSample
    applied: AppliedCommand | None = None
