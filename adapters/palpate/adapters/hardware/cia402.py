"""Arm adapter for CiA 402 drives on CAN: connection and calibration.

The drives represent a modern refit: there is no evidence that any Zebra Zero had such drives. Each drive moves one
joint.
"""

from dataclasses import dataclass
from typing import Annotated, Final

from palpate.adapters.hardware.can_table import CanBusTable
from palpate.adapters.hardware.clock import sleeping
from palpate.adapters.hardware.errors import translating
from palpate.adapters.hardware.plugins import RigContext
from palpate.adapters.hardware.served_arm import ArmTable, DriverArm, OpenArm
from palpate.core.errors import ConfigurationError
from palpate.core.ports import CONTROL_RATE_HZ, Range
from palpate.drivers.cia402 import ArmSettings, CanopenLink, Cia402Arm, JointDrive

_NAME: Final = "CiA 402 arm"


@dataclass(frozen=True)
class Cia402Table(CanBusTable, ArmTable):
    """The ``[arm]`` table of a rig file. Vectors have one element per joint."""

    nodes: tuple[int, ...] = (1, 2, 3, 4, 5, 6)
    """CANopen node of each joint's drive."""
    counts_per_rad: tuple[float, ...] = ()
    """Encoder counts per radian of each joint."""
    zero_counts: tuple[int, ...] = ()
    """Encoder counts at each joint's zero. Default: 0 for every joint."""
    host_node: Annotated[int, Range(1, 127)] = ArmSettings.host_node
    """CANopen node of this computer, whose heartbeat the drives monitor."""


def make_cia402(table: Cia402Table, context: RigContext) -> DriverArm:
    """Return an arm with CiA 402 drives."""
    joints = len(context.lower_rad)
    zeros = table.zero_counts or (0,) * joints
    for name, vector in (("nodes", table.nodes), ("counts_per_rad", table.counts_per_rad), ("zero_counts", zeros)):
        if len(vector) != joints:
            raise ConfigurationError(f"arm.{name}", vector, f"{joints} numbers, one per joint of {context.arm.name}")
    with translating("arm"):
        drives = tuple(
            JointDrive(
                node=node, counts_per_rad=scale, lower_rad=lower, upper_rad=upper, velocity_rad_per_s=speed,
                zero_counts=zero,
            )
            for node, scale, zero, lower, upper, speed in zip(
                table.nodes, table.counts_per_rad, zeros, context.lower_rad, context.upper_rad,
                context.velocity_limit_rad_s, strict=True,
            )
        )  # fmt: skip
        arm_settings = ArmSettings(
            joints=drives,
            control_rate_Hz=CONTROL_RATE_HZ,
            divider=table.divider,
            host_node=table.host_node,
            missed_cycles=max(1, round(ArmSettings.missed_cycles * table.timeout_scale)),
            heartbeat_timeout_ms=round(ArmSettings.heartbeat_timeout_ms * table.timeout_scale),
            host_watchdog_ms=round(ArmSettings.host_watchdog_ms * table.timeout_scale),
            sdo_timeout_s=ArmSettings.sdo_timeout_s * table.timeout_scale,
            transition_timeout_s=ArmSettings.transition_timeout_s * table.timeout_scale,
        )

    def open_bus() -> OpenArm:
        link = CanopenLink.open(**table.bus)
        clock = context.clock
        return OpenArm(Cia402Arm(link, arm_settings, now_ns=clock.now_ns, sleep=sleeping(clock)), link.close)

    return DriverArm(_NAME, open_bus, context.clock, context.limiter, table)
