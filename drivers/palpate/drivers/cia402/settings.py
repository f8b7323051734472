"""How the arm's drives are set up, one record a joint and one for the arm, and the rates that the bus carries.

Standard knowledge (CAN 2.0A): a data frame with an 11-bit identifier and s data bytes is 44 + 8 s bits plus 3 of
interframe space; of these 34 + 8 s bits are subject to stuffing, at worst one bit for every four after the first.
CALC: 8 bytes make 111 bits, at worst 135; a PDO of 6 bytes 95, at worst 115.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from math import isfinite
from typing import Final

from palpate.drivers.can import HIGHEST_NODE
from palpate.drivers.cia402.object_dictionary import OperationMode
from palpate.drivers.device import Applied, BusBudget, clamped, held_back
from palpate.drivers.errors import RefusedError, SettingError

PDO_BYTES: Final = 6, 7
"""Controlword and set-point; statusword, position and mode."""

HIGHEST_LOAD: Final = 0.8
"""Share of the bus that cyclic frames may fill: SDO answers and repeated frames need the rest. A choice."""


def frame_bits(data_bytes: int, *, stuffed: bool = True) -> int:
    """Bits of one data frame with an 11-bit identifier, interframe space included.

    Args:
        data_bytes: Payload, 0 to 8.
        stuffed: Count the worst case of stuff bits.
    """
    stuffing = (33 + 8 * data_bytes) // 4 if stuffed else 0
    return 47 + 8 * data_bytes + stuffing


def bits_per_cycle(drives: int, *, stuffed: bool = True) -> int:
    """Bits of the RPDOs, the SYNC and the TPDOs of one cycle."""
    both = sum(frame_bits(size, stuffed=stuffed) for size in PDO_BYTES)
    return drives * both + frame_bits(0, stuffed=stuffed)


def bus_budget(drives: int, bitrate: int, heartbeat_s: float) -> BusBudget:
    """The load that one arm puts on its bus, in the worst case of stuffing.

    Args:
        heartbeat_s: Period of every drive's heartbeat, and of the host's.
    """
    bits = bits_per_cycle(drives)
    heartbeats = (drives + 1) * frame_bits(1) / heartbeat_s
    load = f"{drives} drives need {bits} bits a cycle at worst, of {bitrate} bit/s"
    return BusBudget("CAN bus", load, bits / bitrate, max(0.0, HIGHEST_LOAD - heartbeats / bitrate))


_INT32: Final = 2**31 - 1


@dataclass(frozen=True, slots=True, kw_only=True)
class JointDrive:
    """One joint and the drive that turns it.

    Each drive turns one joint alone; a wrist whose motors act together needs drives that decouple it, or a
    transmission above this driver.

    Attributes:
        node: CANopen node number, 1 to 127.
        counts_per_rad: Position counts per radian of the joint; negative where the motor turns the other way.
        velocity_rad_per_s: Greatest joint speed.
        zero_counts: Position counts at joint angle 0.

    Raises:
        SettingError: A value that cannot work.
    """

    node: int
    counts_per_rad: float
    lower_rad: float
    upper_rad: float
    velocity_rad_per_s: float
    zero_counts: int = 0

    def __post_init__(self) -> None:
        self._require(1 <= self.node <= HIGHEST_NODE, f"node number {self.node}", f"use 1 to {HIGHEST_NODE}")
        scale = self.counts_per_rad
        self._require(
            isfinite(scale) and scale != 0.0, f"counts_per_rad = {scale}", "give a finite figure that is not 0"
        )
        ordered = isfinite(self.lower_rad) and isfinite(self.upper_rad) and self.lower_rad < self.upper_rad
        self._require(ordered, f"limits {self.lower_rad} to {self.upper_rad} rad", "give lower_rad < upper_rad")
        speed = self.velocity_rad_per_s
        self._require(isfinite(speed) and speed > 0.0, f"velocity_rad_per_s = {speed}", "give a positive figure")
        most = max(abs(self.counts(self.lower_rad)), abs(self.counts(self.upper_rad)), abs(speed * scale))
        self._require(most <= _INT32, f"{most:.0f} counts do not fit 32 bits", "lower counts_per_rad or the limits")

    def counts(self, angle_rad: float) -> int:
        """Position counts of a joint angle, to the nearest count."""
        return round(angle_rad * self.counts_per_rad) + self.zero_counts

    def angle_rad(self, counts: int) -> float:
        """Joint angle of position counts."""
        return (counts - self.zero_counts) / self.counts_per_rad

    def _require(self, good: bool, problem: str, remedy: str) -> None:
        if not good:
            raise SettingError(f"drive {self.node}", problem, remedy)


@dataclass(frozen=True, slots=True, kw_only=True)
class ArmSettings:
    """The arm as a whole.

    Attributes:
        joints: One drive a joint, in the order of the kinematic model.
        mode: Cyclic synchronous position, or velocity with the position loop in this driver.
        divider: Control ticks per cycle; refused when the bus cannot carry that.
        answer_share: Share of the period within which all drives must have answered a SYNC.
        missed_cycles: Cycles in a row that a drive may leave unanswered before the arm is stopped for good.
        heartbeat_ms: Period of each drive's heartbeat.
        heartbeat_timeout_ms: Silence of a drive that stops the arm for good.
        host_node: Node number of the host's own heartbeat.
        host_watchdog_ms: Silence of the host after which each drive quick-stops by itself. 0 leaves this out: then
            nothing stops the arm when this process dies, and in CSV it keeps its last velocity.
        quick_stop_rad_per_s2: Deceleration of a quick stop. The default, 19, is CALC from the acceleration of 10000
            (30557.75 counts/rad) in ``brendandburns/ros2_zebra_zero``.
        pose_margin_rad: How far the measured pose may lie outside the limits.
        velocity_margin: By what factor the measured velocity may exceed its limit; the times of two SYNCs jitter.
        csv_gain: Share of the position error that CSV removes in one cycle, 0 to 1.
        sdo_timeout_s: Longest wait for an SDO answer.
        transition_timeout_s: Longest wait for a change of state of all drives.

    Raises:
        SettingError: A value that cannot work, or a rate that does not fit the bus.
    """

    joints: tuple[JointDrive, ...]
    control_rate_Hz: int
    mode: OperationMode = OperationMode.CSP
    bitrate: int = 1_000_000
    divider: int = 1
    answer_share: float = 0.5
    missed_cycles: int = 3
    heartbeat_ms: int = 50
    heartbeat_timeout_ms: int = 150
    host_node: int = 126
    host_watchdog_ms: int = 100
    quick_stop_rad_per_s2: float = 19.0
    pose_margin_rad: float = 0.02
    velocity_margin: float = 1.5
    csv_gain: float = 0.5
    sdo_timeout_s: float = 0.3
    transition_timeout_s: float = 2.0

    def __post_init__(self) -> None:
        nodes = [*(joint.node for joint in self.joints), self.host_node]
        if not self.joints or len(set(nodes)) != len(nodes):
            raise SettingError("arm", f"nodes {nodes}, the host's last", "give every drive and the host its own node")
        positive = {
            "bitrate": self.bitrate,
            "missed_cycles": self.missed_cycles,
            "heartbeat_ms": self.heartbeat_ms,
            "quick_stop_rad_per_s2": self.quick_stop_rad_per_s2,
            "sdo_timeout_s": self.sdo_timeout_s,
            "transition_timeout_s": self.transition_timeout_s,
        }
        checks = {f"{name} = {value}": isfinite(value) and value > 0 for name, value in positive.items()}
        checks |= {
            f"answer_share = {self.answer_share}": 0.0 < self.answer_share <= 0.9,
            f"csv_gain = {self.csv_gain}": 0.0 < self.csv_gain <= 1.0,
            f"velocity_margin = {self.velocity_margin}": isfinite(self.velocity_margin) and self.velocity_margin >= 1.0,
            f"pose_margin_rad = {self.pose_margin_rad}": isfinite(self.pose_margin_rad) and self.pose_margin_rad >= 0.0,
            f"heartbeat_timeout_ms = {self.heartbeat_timeout_ms}": self.heartbeat_timeout_ms > self.heartbeat_ms,
            f"heartbeat_ms = {self.heartbeat_ms}": 0 < self.heartbeat_ms <= 0xFFFF,
            f"host_watchdog_ms = {self.host_watchdog_ms}": 0 <= self.host_watchdog_ms <= 0xFFFF,
            f"host_node = {self.host_node}": 1 <= self.host_node <= HIGHEST_NODE,
        }
        for told, good in checks.items():
            if not good:
                raise SettingError("arm", f"{told} cannot work", "see the meaning of this setting")
        self.budget.require(self.control_rate_Hz, self.divider)
        # Three heartbeats of the host within the drives' patience, and they are sent by the cycle alone.
        if 0 < self.host_watchdog_ms < 3 * self.period_s * 1e3:
            problem = f"host_watchdog_ms = {self.host_watchdog_ms} is shorter than three cycles"
            raise SettingError("arm", problem, "make it longer, or the rate higher")

    @property
    def rate_Hz(self) -> Fraction:
        """Cycles a second."""
        return Fraction(self.control_rate_Hz, self.divider)

    @property
    def period_s(self) -> float:
        """Time from one cycle to the next."""
        return float(1 / self.rate_Hz)

    @property
    def period_ns(self) -> int:
        """The same in whole nanoseconds."""
        return int(1_000_000_000 / self.rate_Hz)

    @property
    def budget(self) -> BusBudget:
        """The load on the bus."""
        return bus_budget(len(self.joints), self.bitrate, self.heartbeat_ms * 1e-3)


_SLACK: Final = 1e-9
"""A step of exactly the greatest speed must not be called too fast for its rounding error."""


def require_sound(asked_rad: Sequence[float], joints: Sequence[JointDrive]) -> tuple[float, ...]:
    """The set-point as floats."""
    if len(asked_rad) != len(joints):
        problem = f"{len(asked_rad)} angles for {len(joints)} joints"
        raise RefusedError("arm", problem, "give one angle a joint")
    if not all(isfinite(angle) for angle in asked_rad):
        raise RefusedError("arm", f"set-point {tuple(asked_rad)} is not finite", "mend what computed it")
    return tuple(float(angle) for angle in asked_rad)


def limited(
    asked_rad: tuple[float, ...], previous_rad: tuple[float, ...], joints: Sequence[JointDrive], period_s: float
) -> Applied:
    """A set-point after position and velocity limits."""
    within = clamped(asked_rad, [joint.lower_rad for joint in joints], [joint.upper_rad for joint in joints])
    share = 1.0
    for target, start, joint in zip(within, previous_rad, joints, strict=True):
        step, most = abs(target - start), joint.velocity_rad_per_s * period_s
        if step > most * (1.0 + _SLACK):
            share = min(share, most / step)
    return held_back(asked_rad, within, previous_rad, share)
