"""Inputs to the supervisor other than snapshots, and its outputs."""

import enum
from dataclasses import dataclass
from typing import NamedTuple

from palpate.core.ports import AppliedCommand, CommandReason, JointCommand, JointVector
from palpate.core.trial.frame import ExplorationArea


class TripReason(enum.Enum):
    """Reasons for a supervisor trip."""

    FORCE_LIMIT = "force limit"
    TORQUE_LIMIT = "torque limit"
    FORCE_RATE = "force rate"
    UNEXPECTED_CONTACT = "unexpected contact"
    SAMPLE_INVALID = "sample not valid"
    SAMPLE_STALE = "sample too old"
    SAMPLE_REPEATED = "repeated sample"
    SAMPLE_FROZEN = "frozen sample"
    SAMPLES_RECUR = "recurring samples"
    CHANNEL_FLAT = "flat channel"
    SENSOR_NOISE = "too much sensor noise"
    WRENCH_CONTRACT = "unexpected frame or kind of wrench"
    LATE_CYCLE = "late cycle"
    JOINT_POSITION = "joint outside its limits"
    JOINT_VELOCITY = "joint too fast"
    TRACKING_ERROR = "arm does not follow"
    WORKSPACE = "tip outside the workspace"
    EXPLORATION_AREA = "tip outside the exploration area"
    COMMAND_NOT_FINITE = "command not finite"
    COMMAND_JUMP = "command jump"
    PLATE_NOT_FOUND = "no contact at the depth of the plate"
    CONTACT_MISMATCH = "force response does not match the gripper"
    TORQUE_WITHOUT_FORCE = "torque does not match the force"
    PULLED = "implausible pull"


@dataclass(frozen=True, slots=True)
class Trip:
    """Cause of a supervisor trip.

    Attributes:
        text: The finding and the limit, in plain words with units.
        sample: Source of samples that may be wrong, ``force`` or ``joint``; empty for other causes.
    """

    reason: TripReason
    tick: int
    text: str
    sample: str = ""

    def __str__(self) -> str:
        return f"{self.reason.name}: {self.text}"


@dataclass(frozen=True, slots=True)
class PhaseConstraints:
    """Constraints on contact and position in the current phase of the task; one object serves a whole phase.

    Attributes:
        bias: Wrench at zero load, (6,), N and N m, as the sensor reads it; None before taring.
        area: The area that the tip must not leave; None outside exploration.
        mismatch: Mismatch between force and position found by the task's contact verification; None if there is none.
    """

    contact: bool
    bias: tuple[float, float, float, float, float, float] | None = None
    area: ExplorationArea | None = None
    mismatch: Trip | None = None


@dataclass(frozen=True, slots=True)
class CommandOverride:
    """A command that the supervisor changed.

    Attributes:
        reason: A joint limit for a clamped command, or the trip's reason after a trip.
        requested_rad: The task's command, (n,); after a trip, the position held.
        command_rad: The command sent to the arm, (n,).
        trip: The latched cause; None for a clamped command.
    """

    reason: CommandReason | TripReason
    requested_rad: JointVector
    command_rad: JointVector
    trip: Trip | None = None

    def applied(self, by_arm: AppliedCommand) -> AppliedCommand:
        """Return the command that the arm applied, with the clamp's reason if the arm itself changed nothing."""
        if by_arm.reason is not CommandReason.AS_REQUESTED or not isinstance(self.reason, CommandReason):
            return by_arm
        return AppliedCommand(by_arm.position_rad, self.reason)


class Supervised(NamedTuple):
    """Command to the arm after supervision.

    Attributes:
        command_override: The change to the task's command and its reason; None if unchanged.
    """

    command: JointCommand
    command_override: CommandOverride | None = None
