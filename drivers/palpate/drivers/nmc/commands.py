"""The commands of the NMC table, each as what makes a :class:`NmcCommand`. FACT: libnmc, PyLabRobot, Logosol.

RefusedError is raised where a value does not fit its field, is not finite, or has no place in the command.
"""

import struct
from math import isfinite
from typing import Final

from palpate.drivers.nmc.frames import (
    EVERYBODY,
    GROUP_BIT,
    Code,
    NmcCommand,
    StatusItem,
    StopControl,
    TrajectoryControl,
    refused,
)

NOP: Final = NmcCommand(Code.NOP)
"""Asks for the status and nothing else."""
CLEAR_BITS: Final = NmcCommand(Code.CLEAR_BITS)
"""Clears the sticky fault bits."""
RESET_POS: Final = NmcCommand(Code.RESET_POS)
"""Sets the position counter to zero."""
HARD_RESET: Final = NmcCommand(Code.HARD_RESET)
"""Puts a module back to its state after power-up: address 0, 19200 baud, counter zero, motor off. No reply."""


def _pack(layout: str, *values: int) -> bytes:
    try:
        return struct.pack(f"<{layout}", *values)
    except struct.error as error:
        raise refused(f"a field of {values} does not fit: {error}") from error


def set_addr(address: int) -> NmcCommand:
    """Gives an individual address, 1 to 127, in the group of all modules."""
    if not 1 <= address < GROUP_BIT:
        raise refused(f"individual address {address} must be 1 to 127")
    return NmcCommand(Code.SET_ADDR, bytes((address, EVERYBODY)))


def def_stat(mask: StatusItem) -> NmcCommand:
    """Defines the items of every reply from now on, beginning with the reply to this command."""
    return NmcCommand(Code.DEF_STAT, _pack("B", mask))


def read_stat(mask: StatusItem) -> NmcCommand:
    """Asks for these items once."""
    return NmcCommand(Code.READ_STAT, _pack("B", mask))


def load_traj(
    control: TrajectoryControl,
    *,
    position_counts: int | None = None,
    velocity_word: int | None = None,
    acceleration_word: int | None = None,
) -> NmcCommand:
    """Loads a motion; which fields are there is added to ``control``.

    Args:
        control: SERVO, VELOCITY_PROFILE and START_NOW as wanted.
        position_counts: Target position, s32.
        velocity_word: Magnitude, u32, see :mod:`palpate.drivers.nmc.commands`.
        acceleration_word: Magnitude, u32.
    """
    fields = (
        (TrajectoryControl.POSITION, "i", position_counts),
        (TrajectoryControl.VELOCITY, "I", velocity_word),
        (TrajectoryControl.ACCELERATION, "I", acceleration_word),
    )
    control &= ~(TrajectoryControl.POSITION | TrajectoryControl.VELOCITY | TrajectoryControl.ACCELERATION)
    data = b""
    for bit, layout, value in fields:
        if value is not None:
            control |= bit
            data += _pack(layout, value)
    return NmcCommand(Code.LOAD_TRAJ, _pack("B", control) + data)


def set_gain(
    *,
    kp: int,
    kd: int,
    ki: int,
    integration_limit: int,
    output_limit: int,
    current_limit: int,
    error_limit_counts: int,
    servo_rate_divisor: int,
    deadband: int,
) -> NmcCommand:
    """Sets the servo filter."""
    if servo_rate_divisor < 1:
        raise refused("the servo rate divisor must be 1 at least")
    data = _pack("4h2Bh2B", kp, kd, ki, integration_limit, output_limit, current_limit, error_limit_counts,
                 servo_rate_divisor, deadband)  # fmt: skip
    return NmcCommand(Code.SET_GAIN, data)


def stop_motor(control: StopControl, position_counts: int | None = None) -> NmcCommand:
    """Stops the motor in the way of ``control``; ``StopControl.HERE`` takes a position, s32, and nothing else does."""
    if (position_counts is not None) != bool(control & StopControl.HERE):
        raise refused("STOP_MOTOR takes a position with StopControl.HERE, and only then")
    return NmcCommand(
        Code.STOP_MOTOR, _pack("B", control) + (b"" if position_counts is None else _pack("i", position_counts))
    )


def set_baud(divisor: int) -> NmcCommand:
    """Changes the baud rate of every module that receives it; only ever sent to a group. No reply."""
    return NmcCommand(Code.SET_BAUD, _pack("B", divisor))


TICK_S: Final = 0.512e-3
"""Servo tick with a servo rate divisor of 1."""
_ONE: Final = 65536
_MAX_WORD: Final = 0xFFFF_FFFF


def _word(value: float, what: str) -> int:
    if not isfinite(value) or not 0.0 <= value <= _MAX_WORD:
        raise refused(f"{what} of {value} must be finite, not negative, and fit 32 bits")
    return round(value)


def velocity_word(velocity_counts_per_s: float, servo_rate_divisor: int = 1) -> int:
    """The u32 for a velocity magnitude."""
    return _word(velocity_counts_per_s * _ONE * TICK_S * servo_rate_divisor, "velocity word")


def acceleration_word(acceleration_counts_per_s2: float, servo_rate_divisor: int = 1) -> int:
    """The u32 for an acceleration magnitude."""
    return _word(acceleration_counts_per_s2 * _ONE * (TICK_S * servo_rate_divisor) ** 2, "acceleration word")
