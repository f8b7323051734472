"""Command frames: ``AA | address | (n << 4) | code | n data bytes | sum``. FACT: libnmc, PyLabRobot.

The sum covers all bytes but the first, modulo 256; multi-byte fields are little-endian; n is at most 15.
"""

import enum
from dataclasses import dataclass
from typing import Final


class Code(enum.IntEnum):
    """Command codes in use; a code is the low nibble of a frame's third byte."""

    RESET_POS = 0x0
    SET_ADDR = 0x1
    DEF_STAT = 0x2
    READ_STAT = 0x3
    LOAD_TRAJ = 0x4
    SET_GAIN = 0x6
    STOP_MOTOR = 0x7
    SET_BAUD = 0xA
    CLEAR_BITS = 0xB
    NOP = 0xE
    HARD_RESET = 0xF


class NmcStatus(enum.IntFlag):
    """Status byte, the first of every reply.

    ``OVERCURRENT`` and ``POS_ERROR`` stay set until CLEAR_BITS; ``POS_ERROR`` is also set while the servo is off.
    ``MOVE_DONE`` is clear during a trapezoid and during a velocity ramp.
    """

    MOVE_DONE = 0x01
    CKSUM_ERROR = 0x02
    OVERCURRENT = 0x04
    POWER_ON = 0x08
    POS_ERROR = 0x10
    LIMIT1 = 0x20
    LIMIT2 = 0x40


class Aux(enum.IntFlag):
    """Auxiliary status byte; ``POS_WRAP`` and ``SERVO_OVERRUN`` stay set until CLEAR_BITS."""

    POS_WRAP = 0x02
    SERVO_ON = 0x04
    SERVO_OVERRUN = 0x20


class StatusItem(enum.IntFlag):
    """Bits in the status mask; the items follow the status byte in this order."""

    POSITION = 0x01
    ANALOG = 0x02
    VELOCITY = 0x04
    AUX = 0x08
    HOME = 0x10
    IDENTITY = 0x20
    POSITION_ERROR = 0x40
    PATH_POINTS = 0x80


class TrajectoryControl(enum.IntFlag):
    """Control byte for LOAD_TRAJ; the fields follow it in the order position, velocity, acceleration."""

    POSITION = 0x01
    VELOCITY = 0x02
    ACCELERATION = 0x04
    SERVO = 0x10
    START_NOW = 0x80


class StopControl(enum.IntFlag):
    """Control byte for STOP_MOTOR. ``MOTOR_OFF`` is 0x02; one public driver for the arm uses 0x04, which is wrong."""

    AMP_ENABLE = 0x01
    MOTOR_OFF = 0x02
    ABRUPT = 0x04
    SMOOTH = 0x08
    HERE = 0x10


STICKY_STATUS: Final = NmcStatus.OVERCURRENT | NmcStatus.POS_ERROR
"""Status bits that only CLEAR_BITS clears."""


HEADER: Final = 0xAA
FRAME_OVERHEAD_BYTES: Final = 4
MAX_DATA_BYTES: Final = 15
EVERYBODY: Final = 0xFF
"""Group address on which every module listens after power-up."""


def checksum(data: bytes) -> int:
    """Return the sum of the bytes modulo 256."""
    return sum(data) & 0xFF


@dataclass(frozen=True, slots=True)
class NmcCommand:
    """A command without an address, with up to 15 data bytes."""

    code: Code
    data: bytes = b""

    @property
    def size_bytes(self) -> int:
        """Length of the frame on the line, in bytes."""
        return FRAME_OVERHEAD_BYTES + len(self.data)

    def frame(self, address: int) -> bytes:
        """Return the frame for an address."""
        body = bytes((address, len(self.data) << 4 | self.code)) + self.data
        return bytes((HEADER,)) + body + bytes((checksum(body),))
