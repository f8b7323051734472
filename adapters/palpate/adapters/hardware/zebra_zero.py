"""Arm adapter for the Zebra Zero on its NMC bus: wiring and calibration."""

from __future__ import annotations

import json
import os
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Final

from typing_extensions import override

from palpate.adapters.files import write_whole
from palpate.adapters.hardware.clock import sleeping
from palpate.adapters.hardware.errors import translating
from palpate.adapters.hardware.plugins import RigContext
from palpate.adapters.hardware.served_arm import ArmTable, DriverArm, OpenArm
from palpate.core.errors import ConfigurationError
from palpate.core.ports import CONTROL_RATE_HZ, CommandLimiter, OneOf, Range
from palpate.drivers.errors import WiringError
from palpate.drivers.nmc import BAUD_DIVISORS, POWER_UP_BAUD, BusSettings
from palpate.drivers.serial_port import close_serial, open_serial
from palpate.drivers.zebra_zero import CountsStore, JointLimits, SixCounts, Transmission, ZebraZero, ZebraZeroSettings

_NAME: Final = "Zebra Zero"
_JOINTS: Final = 6
_OTHERS: Final = ("ur3", "ur5", "ur10", "z1")
"""Six-joint arms from other manufacturers that are included in palpate."""


@dataclass(frozen=True)
class CountsFile(CountsStore):
    """A file that stores the counters."""

    path: Path

    @override
    def load(self) -> list[int] | None:
        if not os.path.exists(self.path):
            return None
        try:
            return [int(count) for count in json.loads(self.path.read_text())]
        except (OSError, ValueError, TypeError) as error:
            problem = f"{self.path} cannot be read ({error})"
            raise WiringError(_NAME, problem, "delete it and begin from the home pose") from error

    @override
    def save(self, counts: SixCounts) -> None:
        # A stop must not fail because of a full disk; without the file, the next run begins from the home pose.
        with suppress(OSError):
            write_whole(self.path, json.dumps(counts))


@dataclass(frozen=True)
class ZebraTable(ArmTable):
    """The ``[arm]`` table of a rig file."""

    port: str = "/dev/ttyUSB0"
    """Serial port of the bus."""
    baud: Annotated[int, OneOf(*BAUD_DIVISORS)] = BusSettings.baud
    """Baud rate after start-up."""
    adapter_latency_ms: Annotated[float, Range(0.0, 100.0)] = BusSettings.adapter_latency_s * 1e3
    """Latency timer of the USB adapter."""
    divider: Annotated[int, Range(1, 14)] = ZebraZeroSettings.divider
    at_home: bool = False
    """Confirmation that the arm is always in its home pose when its controller is switched on."""
    counts_file: str = ""
    """File that stores the counters between runs; empty disables it."""
    joint1_sign: Annotated[int, OneOf(1, -1)] = Transmission.joint_1_sign
    """Counting direction of joint 1."""
    wrist_factor: Annotated[float, Range(0.1, 10.0)] = Transmission.wrist_factor
    """Factor for the wrist's counts: 1.38488 (24:17.33) with the other gears."""
    require_power: bool = ZebraZeroSettings.require_power
    """Treat a missing motor supply report as a fault. Use false for amplifiers that never report it."""
    use_limit_inputs: bool = ZebraZeroSettings.use_limit_inputs
    """Treat an active limit input as a fault. Use false if no switch is wired to it."""
    velocity_rad_s: Annotated[float, Range(0.01, 10.0)] = JointLimits.velocity_rad_per_s
    """Velocity limit for each joint."""
    acceleration_rad_s2: Annotated[float, Range(0.1, 1000.0)] = JointLimits.acceleration_rad_per_s2
    """Acceleration limit for each joint, enforced by firmware with trapezoidal profiles."""
    max_age_ms: Annotated[float, Range(1.0, 10_000.0)] = 100.0
    reset_wait_ms: Annotated[float, Range(0.0, 10_000.0)] = BusSettings.reset_wait_s * 1e3
    """Time for the modules to restart after a reset."""


def make_zebra_nmc(table: ZebraTable, context: RigContext) -> DriverArm:
    """Return a Zebra Zero on its own serial bus."""
    if len(context.lower_rad) != _JOINTS or context.arm.name in _OTHERS:
        raise ConfigurationError("arm", context.arm.name, f"zebra-zero, or the URDF of this arm, with {_JOINTS} joints")
    with translating("arm"):
        arm_settings = ZebraZeroSettings(
            bus=BusSettings(
                baud=table.baud,
                adapter_latency_s=table.adapter_latency_ms * 1e-3,
                slack_s=BusSettings.slack_s * table.timeout_scale,
                reset_wait_s=table.reset_wait_ms * 1e-3,
            ),
            transmission=Transmission(joint_1_sign=table.joint1_sign, wrist_factor=table.wrist_factor),
            require_power=table.require_power,
            use_limit_inputs=table.use_limit_inputs,
            limits=JointLimits(
                velocity_rad_per_s=table.velocity_rad_s, acceleration_rad_per_s2=table.acceleration_rad_s2
            ),
            control_rate_Hz=CONTROL_RATE_HZ,
            divider=table.divider,
        )

    def open_bus() -> OpenArm:
        port, clock = open_serial(table.port, POWER_UP_BAUD, _NAME), context.clock
        store = CountsFile(Path(table.counts_file)) if table.counts_file else None
        arm = ZebraZero(port, clock.now_ns, sleeping(clock), arm_settings, at_home=table.at_home, store=store)
        return OpenArm(arm, lambda: close_serial(port))

    limits = arm_settings.limits
    within = CommandLimiter(limits.lower_rad, limits.upper_rad, (limits.velocity_rad_per_s,) * _JOINTS, CONTROL_RATE_HZ)
    return DriverArm(_NAME, open_bus, context.clock, within, table)
