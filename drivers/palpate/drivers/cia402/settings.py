"""Settings for the arm's drives, with one record per joint and another for the arm."""

from dataclasses import dataclass
from fractions import Fraction
from math import isfinite
from typing import Final

from palpate.drivers.cia402.codec import HIGHEST_NODE
from palpate.drivers.errors import SettingError

HEARTBEAT_MS: Final = 50
"""Heartbeat period of each drive."""
ANSWER_SHARE: Final = 0.5
"""Fraction of the period within which all drives must have answered a SYNC."""
POSE_MARGIN_RAD: Final = 0.02
"""Amount by which a measured joint angle may exceed its limits."""
_INT32: Final = 2**31 - 1


@dataclass(frozen=True, slots=True, kw_only=True)
class JointDrive:
    """Settings for a joint and its drive.

    Each drive moves only one joint. A wrist with coupled motors needs drives that decouple it, or a transmission model
    above this driver.

    Attributes:
        node: CANopen node number, 1 to 127.
        counts_per_rad: Position counts per radian of the joint; negative if the motor turns in the opposite direction.
        zero_counts: Position counts at joint angle 0.

    Raises:
        SettingError: A value is invalid.
    """

    node: int
    counts_per_rad: float
    lower_rad: float
    upper_rad: float
    velocity_rad_per_s: float
    zero_counts: int = 0

    def __post_init__(self) -> None:
        scale = self.counts_per_rad
        if not 1 <= self.node <= HIGHEST_NODE or not isfinite(scale) or scale == 0.0:
            problem = f"node {self.node} with {scale} counts_per_rad"
            raise SettingError(f"drive {self.node}", problem, f"nodes are 1 to {HIGHEST_NODE}, and counts no zero")
        most = max(abs(self.counts(self.lower_rad)), abs(self.counts(self.upper_rad)))
        if most > _INT32:
            raise SettingError(f"drive {self.node}", f"{most} counts need more than 32 bits", "lower counts_per_rad")

    def counts(self, angle_rad: float) -> int:
        """Convert a joint angle to position counts, rounded to the nearest count."""
        return round(angle_rad * self.counts_per_rad) + self.zero_counts

    def angle_rad(self, counts: int) -> float:
        """Return the joint angle for position counts."""
        return (counts - self.zero_counts) / self.counts_per_rad


@dataclass(frozen=True, kw_only=True)
class ArmSettings:
    """Settings for the whole arm.

    Attributes:
        joints: One drive per joint, in the order of the kinematic model.
        divider: Number of control ticks per cycle.
        missed_cycles: Number of consecutive unanswered cycles after which the arm latches a stop.
        heartbeat_timeout_ms: Time without a drive's heartbeat after which the arm latches a stop.
        host_watchdog_ms: Time without the host's heartbeat after which each drive quick-stops on its own.
        quick_stop_rad_per_s2: Deceleration in a quick stop. The default, 19, is calculated from the acceleration of
            10000 (30557.75 counts/rad) in ``brendandburns/ros2_zebra_zero``.
        transition_timeout_s: Time limit for all drives to change state.

    Raises:
        SettingError: A value is invalid.
    """

    joints: tuple[JointDrive, ...]
    control_rate_Hz: int
    divider: int = 1
    missed_cycles: int = 3
    heartbeat_timeout_ms: int = 150
    host_node: int = 126
    host_watchdog_ms: int = 100
    quick_stop_rad_per_s2: float = 19.0
    sdo_timeout_s: float = 0.3
    transition_timeout_s: float = 2.0

    def __post_init__(self) -> None:
        nodes = [*(joint.node for joint in self.joints), self.host_node]
        if not self.joints or len(set(nodes)) != len(nodes):
            raise SettingError("arm", f"nodes {nodes}, the host's last", "give every drive and the host its own node")
        # Three heartbeats of the host must fit in the watchdog time, and only the cycle sends them.
        if self.host_watchdog_ms < 3 * self.period_s * 1e3:
            problem = f"host_watchdog_ms = {self.host_watchdog_ms} is shorter than three cycles"
            raise SettingError("arm", problem, "make it longer, or the rate higher")

    @property
    def rate_Hz(self) -> Fraction:
        """Cycles per second."""
        return Fraction(self.control_rate_Hz, self.divider)

    @property
    def period_s(self) -> float:
        """Time from one cycle to the next."""
        return float(1 / self.rate_Hz)

    @property
    def period_ns(self) -> int:
        """The period in whole nanoseconds."""
        return int(1_000_000_000 / self.rate_Hz)
