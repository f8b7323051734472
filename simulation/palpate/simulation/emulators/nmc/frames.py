"""Communication with an NMC module: command frames, checksums, status items and bit names.

Sources: the public NMC library in ``libnmc/`` of brendandburns/ros2_zebra_zero (commit 6a558d7), the Logosol LS-231SE
and LS-173AP manuals (a PIC-SERVO-compatible command set), and byte vectors from the tests of PyLabRobot's VSpin driver.
"""

import enum
from dataclasses import dataclass
from typing import Final

HEADER: Final = 0xAA
"""First byte of every command (FACT, libnmc), which is not part of the checksum."""
TICK_NS: Final = 512_000
"""Minimum servo tick (FACT, PIC-SERVO: 0.512 ms)."""
POWER_UP_BAUD: Final = 19_200
"""Rate after power-up or hard reset, 8N1 (FACT, libnmc)."""
_CLOCK_Hz: Final = 20_000_000
_DIVISORS: Final = {63: 19_200, 64: 19_200, 20: 57_600, 21: 57_600, 10: 115_200, 5: 230_400}


class CommandCode(enum.IntEnum):
    """Low nibble of the command byte for the emulated commands (FACT, libnmc)."""

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


class StatusBits(enum.IntFlag):
    """Bits in the status byte (FACT, libnmc)."""

    MOVE_DONE = 0x01
    CHECKSUM_ERROR = 0x02
    OVERCURRENT = 0x04
    POWER_ON = 0x08
    POSITION_ERROR = 0x10
    LIMIT1 = 0x20
    LIMIT2 = 0x40


class Auxiliary(enum.IntFlag):
    """Bits in the auxiliary status byte (FACT, libnmc)."""

    POSITION_WRAP = 0x02
    SERVO_ON = 0x04
    ACCELERATED = 0x08
    SLEWED = 0x10
    SERVO_OVERRUN = 0x20


class Load(enum.IntFlag):
    """Control byte for LOAD_TRAJ (FACT, libnmc)."""

    POSITION = 0x01
    VELOCITY = 0x02
    ACCELERATION = 0x04
    SERVO = 0x10
    NOW = 0x80


class StopMotorBits(enum.IntFlag):
    """Control byte for STOP_MOTOR (FACT, libnmc)."""

    AMPLIFIER = 0x01
    MOTOR_OFF = 0x02
    ABRUPT = 0x04
    SMOOTH = 0x08
    HERE = 0x10


@dataclass(frozen=True, slots=True)
class Frame:
    """A complete command with up to 15 bytes, to a module (address 0 to 0x7F) or a group (0x80 to 0xFF)."""

    address: int
    command: int
    data: bytes
    intact: bool


class FrameParser:
    """Parser that finds command frames in a stream of bytes.

    As in the firmware, there is no time-out between bytes, so a partial frame waits for its remaining bytes. Zeros
    eventually complete any partial frame, usually with a wrong checksum. Further zeros are skipped, because a zero is
    not a header. Therefore hosts resynchronise with 20 or 30 zeros (FACT, libnmc).
    """

    def __init__(self) -> None:
        self._pending = bytearray()

    def push(self, byte: int) -> Frame | None:
        """Process one byte and return the frame that it completes, if any."""
        pending = self._pending
        if not pending and byte != HEADER:
            return None
        pending.append(byte)
        if len(pending) < 4 or len(pending) < 4 + (pending[2] >> 4):
            return None
        frame = Frame(
            address=pending[1],
            command=pending[2] & 0x0F,
            data=bytes(pending[3:-1]),
            intact=sum(pending[1:-1]) & 0xFF == pending[-1],
        )
        pending.clear()
        return frame


def sealed(body: bytes) -> bytes:
    """Return a reply with its checksum, the sum of its bytes modulo 256 (FACT, libnmc)."""
    return body + bytes([sum(body) & 0xFF])


def baud_of_divisor(divisor: int) -> int:
    """Return the line rate selected by SET_BAUD's data byte.

    The divisors used by public hosts give their nominal rates (FACT: libnmc 63, 20, 10; another driver 64, 21, 10 and 5
    for 230400); others follow the usual UART formula with a 20 MHz clock (assumed).
    """
    return _DIVISORS.get(divisor, _CLOCK_Hz // (16 * (divisor + 1)))
