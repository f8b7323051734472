"""NMC commands, as constants and as functions that return them. FACT: libnmc, PyLabRobot, Logosol."""

import struct
from typing import Final

from palpate.drivers.nmc.frames import EVERYBODY, Code, NmcCommand, StatusItem, StopControl, TrajectoryControl

NOP: Final = NmcCommand(Code.NOP)
"""Requests only the status."""
CLEAR_BITS: Final = NmcCommand(Code.CLEAR_BITS)
"""Clears the sticky fault bits."""
RESET_POS: Final = NmcCommand(Code.RESET_POS)
"""Sets the position counter to zero."""
HARD_RESET: Final = NmcCommand(Code.HARD_RESET)
"""Resets a module to its state after power-up: address 0, 19200 baud, counter zero, motor off. No reply."""


def set_addr(address: int) -> NmcCommand:
    """Assign an individual address, 1 to 127, in the group of all modules."""
    return NmcCommand(Code.SET_ADDR, bytes((address, EVERYBODY)))


def def_stat(mask: StatusItem) -> NmcCommand:
    """Define the items of every reply, starting with the reply to this command."""
    return NmcCommand(Code.DEF_STAT, bytes((mask,)))


def read_stat(mask: StatusItem) -> NmcCommand:
    """Request the items in the mask once."""
    return NmcCommand(Code.READ_STAT, bytes((mask,)))


def load_traj(control: TrajectoryControl, position_counts: int, *words: int) -> NmcCommand:
    """Load a motion to a position (signed 32-bit).

    Args:
        control: Optional bits SERVO and START_NOW.
        words: Velocity and acceleration words; without them, both stay unchanged.
    """
    control |= TrajectoryControl.POSITION
    if words:
        control |= TrajectoryControl.VELOCITY | TrajectoryControl.ACCELERATION
    return NmcCommand(Code.LOAD_TRAJ, struct.pack(f"<Bi{len(words)}I", control, position_counts, *words))


def set_gain(*values: int) -> NmcCommand:
    """Set kp, kd, ki, servo rate divisor, deadband, and the limits on integral, output, current and position error."""
    return NmcCommand(Code.SET_GAIN, struct.pack("<4h2Bh2B", *values))


def stop_motor(control: StopControl, position_counts: int | None = None) -> NmcCommand:
    """Stop the motor as ``control`` specifies; only ``StopControl.HERE`` takes a position (32-bit)."""
    position = b"" if position_counts is None else struct.pack("<i", position_counts)
    return NmcCommand(Code.STOP_MOTOR, bytes((control,)) + position)


def set_baud(divisor: int) -> NmcCommand:
    """Change the baud rate of every module that receives the command. Send it only to groups; no module replies."""
    return NmcCommand(Code.SET_BAUD, bytes((divisor,)))


TICK_S: Final = 0.512e-3
"""Duration of a servo tick if the servo rate divisor is 1."""
_ONE: Final = 65536


def velocity_word(velocity_counts_per_s: float) -> int:
    """Return the unsigned 32-bit word for a velocity magnitude."""
    return round(velocity_counts_per_s * _ONE * TICK_S)


def acceleration_word(acceleration_counts_per_s2: float) -> int:
    """Return the unsigned 32-bit word for an acceleration magnitude."""
    return round(acceleration_counts_per_s2 * _ONE * TICK_S**2)
