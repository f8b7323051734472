"""Servo in a PIC-SERVO module, with set-points, encoder register, trips and limits."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from typing import Final

from palpate.simulation.emulators.motors import JointPlant
from palpate.simulation.emulators.nmc.frames import StopMotorBits
from palpate.simulation.emulators.nmc.motion import Profile

_HALF: Final = 1 << 31
_TURN: Final = 1 << 32


@dataclass(frozen=True, slots=True)
class GainParameters:
    """Parameters for SET_GAIN. All are zero at power-up, so the servo cannot move anything (INFERENCE).

    Attributes:
        kp: Proportional gain; with 0 the motor does not follow.
        kd: Derivative gain. It has no effect here, because the plant represents the closed loop.
        output_limit: Maximum duty, 0 to 255; with 0 the motor does not follow.
        error_limit: Position error in counts at which the servo switches off.
    """

    kp: int = 0
    kd: int = 0
    ki: int = 0
    integration_limit: int = 0
    output_limit: int = 0
    current_limit: int = 0
    error_limit: int = 0
    rate_divisor: int = 1

    @property
    def follow(self) -> bool:
        """Return True if a motor with these gains follows its set-point."""
        return self.kp != 0 and self.output_limit > 0

    @classmethod
    def decoded(cls, data: bytes) -> GainParameters:
        """Return the parameters in SET_GAIN's 14 data bytes. The last compensates for a dead band (FACT, libnmc)."""
        kp, kd, ki, il, ol, cl, el, sr, _ = struct.unpack("<hhhhBBhBB", data[:14])
        return cls(kp, kd, ki, il, ol, cl, el, max(sr, 1))


@dataclass(frozen=True, slots=True)
class Trajectory:
    """Trajectory buffered by LOAD_TRAJ. The words are in 1/65536 counts per tick, and per tick squared."""

    control: int = 0
    position_counts: int = 0
    velocity: int = 0
    acceleration: int = 0


class PicServo:
    """A motor's servo. At power-up, servo and amplifier are off, and the gains and the position register are zero.

    The register is zero at the motor's position at power-up, regardless of the arm's true pose (FACT: the encoders
    are incremental).
    """

    def __init__(self, axis: int, plant: JointPlant, *, powered: bool = True) -> None:
        self.profile = Profile()
        self.gains, self.buffer = GainParameters(), Trajectory()
        self.amplifier = self.on = False
        self.powered = powered
        self.limits = (False, False)
        self.position_error = True  # the bit is set while the servo is off
        self.overcurrent = self.wrapped = self.overrun = False
        self.velocity_counts = self.measured_counts = self.home_counts = 0
        self._axis, self._plant = axis, plant
        self._origin = plant.motor_counts(axis)
        plant.release(axis)

    @property
    def error_counts(self) -> int:
        """Commanded minus measured position, or 0 while the servo is off."""
        return self.profile.counts - self.measured_counts if self.on else 0

    def start(self) -> None:
        """Start the trajectory buffered by LOAD_TRAJ."""
        load = self.buffer
        self._switch_on()
        if self.on:
            self.profile.start_trapezoid(load.position_counts, load.velocity, load.acceleration)

    def stop(self, how: StopMotorBits, here_counts: int) -> None:
        """Execute STOP_MOTOR. The first bit set in this order takes effect: off, abrupt, smooth, here (assumed)."""
        self.amplifier = bool(how & StopMotorBits.AMPLIFIER)
        if how & StopMotorBits.MOTOR_OFF:
            self.switch_off()
        elif how & StopMotorBits.ABRUPT:
            self._switch_on()
            self.profile.hold(self.measured_counts)
        elif how & StopMotorBits.SMOOTH:
            self.profile.start_velocity(0, self.profile.acceleration)
        elif how & StopMotorBits.HERE:
            self._switch_on()
            self.profile.hold(here_counts)

    def switch_off(self) -> None:
        """Switch the motor's torque off."""
        self.profile.hold(self.measured_counts)
        self.on, self.position_error = False, True
        self._plant.release(self._axis)

    def set_position(self, counts: int) -> None:
        """Set the value of the register at the motor's current position. The set-point and the error do not change."""
        self.measured_counts = self._plant.motor_counts(self._axis) - self._origin
        self._shift(counts - self.measured_counts)

    def clear_bits(self) -> None:
        """Execute CLEAR_BITS. While the servo is off, the position error bit is immediately set again."""
        self.overcurrent = self.wrapped = self.overrun = False
        self.position_error = not self.on

    def set_power(self, *, powered: bool) -> None:
        """Switch the motor supply on or off. This never switches a servo on."""
        self.powered = powered
        if not powered:
            self.switch_off()

    def tick(self) -> None:
        """Run one servo cycle."""
        if self.on:
            self.profile.tick()
            if self.amplifier and self.gains.follow:
                self._plant.set_motor_counts(self._axis, self.profile.counts + self._origin)
            else:
                self._plant.release(self._axis)
        counts = self._plant.motor_counts(self._axis) - self._origin
        self.velocity_counts, self.measured_counts = counts - self.measured_counts, counts
        if not -_HALF <= counts < _HALF:
            self._shift(-_TURN if counts > 0 else _TURN)
            self.wrapped = True
        if self.on and abs(self.profile.counts - self.measured_counts) > self.gains.error_limit:
            self.switch_off()

    def _shift(self, counts: int) -> None:
        self._origin -= counts
        self.measured_counts += counts
        self.profile.shift(counts)

    def _switch_on(self) -> None:
        if self.powered and not self.on:
            self.profile.hold(self.measured_counts)
            self.on = True
