"""Settings of the arm."""

from __future__ import annotations

import enum
from dataclasses import dataclass, field
from math import isfinite
from typing import Final

from palpate.drivers.errors import SettingError
from palpate.drivers.nmc.budget import LOOP_RATE_HZ, CycleBudget, LineTiming, exchange_size_bytes, same_for_all
from palpate.drivers.nmc.commands import set_gain, stop_motor
from palpate.drivers.nmc.flags import Item, Stop
from palpate.drivers.nmc.frames import Command
from palpate.drivers.nmc.settings import BusSettings
from palpate.drivers.zebra_zero.counts import DEVICE, JOINTS, Transmission
from palpate.drivers.zebra_zero.limits import JointLimits

FIRMWARE_WITH_MOVING_TARGETS: Final = 10
"""Firmware of the PIC-SERVO SC that takes a new trapezoid while one runs. FACT: data sheet."""


class Streaming(enum.Enum):
    """How set-points reach a motor.

    ``TRAPEZOID`` loads a new target position while the last is still being approached, so the firmware's own limits on
    velocity and acceleration stay in force. FACT: firmware 10 of the SC allows it; on a Logosol LS-173AP a new
    position during a motion is taken as an offset, and the arm goes astray. ``STOP_HERE`` sets the servo's position
    without a profile (FACT: Logosol, libnmc), which works on both but leaves only this driver's limits.
    ``BY_FIRMWARE``, the default, takes the trapezoid only where every module has the firmware that is documented.
    """

    BY_FIRMWARE = "by firmware"
    TRAPEZOID = "trapezoid"
    STOP_HERE = "stop here"


@dataclass(frozen=True, slots=True)
class Gains:
    """Servo filter. FACT: the port sends these defaults to the real arm.

    Attributes:
        kp: Proportional gain.
        kd: Derivative gain.
        ki: Integral gain.
        integration_limit: Limit of the integral.
        output_limit: Highest PWM, 255 at most.
        current_limit: 0: none.
        error_limit_counts: Position error at which the firmware switches the servo off.
        servo_rate_divisor: Servo tick in units of 0.512 ms.
        deadband: Compensation of the amplifier's dead band.
        step_multiplier: A 15th data byte, which drivers for firmware 10 send; None: 14 bytes, as the port does.
    """

    kp: int = 100
    kd: int = 1000
    ki: int = 0
    integration_limit: int = 0
    output_limit: int = 255
    current_limit: int = 0
    error_limit_counts: int = 4000
    servo_rate_divisor: int = 1
    deadband: int = 0
    step_multiplier: int | None = None

    def command(self) -> Command:
        """The SET_GAIN command.

        Raises:
            RefusedError: A value does not fit its field.
        """
        return set_gain(
            kp=self.kp,
            kd=self.kd,
            ki=self.ki,
            integration_limit=self.integration_limit,
            output_limit=self.output_limit,
            current_limit=self.current_limit,
            error_limit_counts=self.error_limit_counts,
            servo_rate_divisor=self.servo_rate_divisor,
            deadband=self.deadband,
            step_multiplier=self.step_multiplier,
        )


@dataclass(frozen=True, slots=True)
class ZebraZeroSettings:
    """The arm and how it is run. Values without a mark are choices of this driver.

    Attributes:
        bus: The bus.
        transmission: Counts and joints.
        limits: Joint limits.
        gains: Servo filter of every axis.
        streaming: How set-points reach the motors.
        rate_Hz: Rate of ``cycle``; refused when the bus cannot carry it.
        reserve: Share of the period that the bus must leave free.
        reply_items: Items of every reply in a cycle; POSITION at least. AUX costs a byte an axis and tells at once
            when a servo went off.
        require_power: A module that reports no motor supply is a fault. INFERENCE: some amplifiers may not report it.
        use_limit_inputs: A limit input that is set is a fault. NOT FOUND whether the arm has limit switches.
        limit_tolerance_rad: How far a measured pose may be beyond the limits before that is a fault.
        stored_tolerance_counts: How far counters may be from the stored ones to be resumed.
        profile_margin: Factor of the firmware's own velocity and acceleration limits over those of the joints, so
            that a profile can catch up with its set-points.
        stop_timeout_s: Time in which a stop must be seen to be over. CALC: 53 ms brake the highest velocity.

    Raises:
        SettingError: A value that cannot work.
    """

    bus: BusSettings = field(default_factory=BusSettings)
    transmission: Transmission = field(default_factory=Transmission)
    limits: JointLimits = field(default_factory=JointLimits)
    gains: Gains = field(default_factory=Gains)
    streaming: Streaming = Streaming.BY_FIRMWARE
    rate_Hz: float = LOOP_RATE_HZ / 3
    reserve: float = 0.1
    reply_items: Item = Item.POSITION | Item.AUX
    require_power: bool = True
    use_limit_inputs: bool = True
    limit_tolerance_rad: float = 0.02
    stored_tolerance_counts: int = 200
    profile_margin: float = 1.25
    stop_timeout_s: float = 1.0

    def __post_init__(self) -> None:
        checks = (
            (isfinite(self.rate_Hz) and self.rate_Hz > 0.0, f"rate_Hz = {self.rate_Hz}", "positive"),
            (0.0 <= self.reserve < 1.0, f"reserve = {self.reserve}", "0 to 1"),
            (bool(self.reply_items & Item.POSITION), f"reply_items = {self.reply_items!r}", "with POSITION"),
            (0.0 <= self.limit_tolerance_rad < 0.5, f"limit_tolerance_rad = {self.limit_tolerance_rad}", "0 to 0.5"),
            (self.stored_tolerance_counts >= 0, f"{self.stored_tolerance_counts=}", "0 at least"),
            (1.0 <= self.profile_margin <= 10.0, f"profile_margin = {self.profile_margin}", "1 to 10"),
            (0.0 < self.stop_timeout_s <= 60.0, f"stop_timeout_s = {self.stop_timeout_s}", "up to 60"),
            (self.bus.max_modules >= JOINTS, f"max_modules = {self.bus.max_modules}", f"{JOINTS} at least"),
        )
        for good, found, wanted in checks:
            if not good:
                raise SettingError(DEVICE, found, f"must be {wanted}")
        self.budget().require(self.rate_Hz)

    def budget(self) -> CycleBudget:
        """What one cycle with set-points for all axes costs; both ways of streaming cost the same."""
        line = LineTiming(self.bus.baud, self.bus.adapter_latency_s, self.bus.turnaround_s)
        setpoint = stop_motor(Stop.AMP_ENABLE | Stop.HERE, 0)
        return same_for_all(line, JOINTS, (exchange_size_bytes(setpoint, self.reply_items),), self.reserve)
