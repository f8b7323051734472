"""What goes into the supervisor beside the snapshots, and what comes out of it."""

import enum
from dataclasses import dataclass
from typing import NamedTuple

from palpate.core.ports import AppliedCommand, CommandReason, JointCommand, JointVector
from palpate.core.trial.frame import ExplorationArea


class TripReason(enum.Enum):
    """Why the supervisor took over."""

    FORCE_LIMIT = "force limit"
    TORQUE_LIMIT = "torque limit"
    FORCE_RATE = "force rate"
    UNEXPECTED_CONTACT = "unexpected contact"
    SAMPLE_INVALID = "sample not valid"
    SAMPLE_STALE = "sample too old"
    SAMPLE_REPEATED = "no new sample"
    SAMPLE_FROZEN = "sample does not change"
    SAMPLES_RECUR = "samples recur"
    CHANNEL_FLAT = "channel without its noise"
    SENSOR_NOISE = "noise above the sensor's own"
    WRENCH_CONTRACT = "wrench of another frame or kind"
    LATE_CYCLE = "late cycle"
    JOINT_POSITION = "joint outside its limits"
    JOINT_VELOCITY = "joint too fast"
    TRACKING_ERROR = "arm does not follow"
    WORKSPACE = "tip outside the workspace"
    EXPLORATION_AREA = "tip outside the exploration area"
    COMMAND_NOT_FINITE = "command not finite"
    COMMAND_JUMP = "command jumps"
    PLATE_NOT_FELT = "deeper than the plate can be, with nothing felt"
    CONTACT_MISMATCH = "force does not respond as the gripper's spring does"
    TORQUE_WITHOUT_FORCE = "torque does not fit the force over the tool's lever"
    PULLED = "pulled where the tool can only be pushed"


@dataclass(frozen=True, slots=True)
class Trip:
    """The cause for which the supervisor took over.

    Attributes:
        text: What was found and what it was held against, in plain words, with units.
        sample: Whose samples are not to be trusted, ``force`` or ``joint``; empty for another cause.
    """

    reason: TripReason
    tick: int
    text: str
    sample: str = ""

    def __str__(self) -> str:
        return f"{self.reason.name}: {self.text}"


@dataclass(frozen=True, slots=True)
class Expectation:
    """What the task expects of the world in its present phase; one object serves a whole phase.

    Attributes:
        bias: Wrench that counts as zero, (6,), N and N m, as the sensor reads it; None before taring.
        area: The area that the tip may not leave; None while it does not explore.
        doubt: Why the force sensor cannot be trusted, as the task found by holding force against position; None while
            there is no reason to doubt it.
    """

    contact: bool
    bias: tuple[float, float, float, float, float, float] | None = None
    area: ExplorationArea | None = None
    doubt: Trip | None = None


@dataclass(frozen=True, slots=True)
class Intervention:
    """A command that is not the one that was asked for.

    Attributes:
        reason: Why: a joint limit where the command was clamped, the trip's reason where the supervisor took over.
        asked_rad: What the task asked for, (n,); what was held, once it is no longer asked.
        command_rad: What the arm is sent instead, (n,).
        trip: The latched cause; None for a clamped command.
    """

    reason: CommandReason | TripReason
    asked_rad: JointVector
    command_rad: JointVector
    trip: Trip | None = None

    def applied(self, by_arm: AppliedCommand) -> AppliedCommand:
        """The answer to the task's command: the arm's own, with the reason of a clamp if the arm has none."""
        if by_arm.reason is not CommandReason.AS_ASKED or not isinstance(self.reason, CommandReason):
            return by_arm
        return AppliedCommand(by_arm.position_rad, self.reason)


class Supervised(NamedTuple):
    """What the arm is to be sent.

    Attributes:
        intervention: How and why it differs from what was asked; None when it does not.
    """

    command: JointCommand
    intervention: Intervention | None = None
