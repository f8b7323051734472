"""Velocity and acceleration words of LOAD_TRAJ, and path points.

FACT (data sheet, libnmc): the servo tick is 0.512 ms times the servo rate divisor SR; a velocity word is counts per
tick times 65536, an acceleration word counts per tick squared times 65536. CALC for SR = 1: 33.554432 per count/s and
0.017179869 per count/s2. (One public port of the arm shifts by five bits instead: 32, and far off for accelerations.)
"""

from __future__ import annotations

from math import isfinite
from typing import Final

from palpate.drivers.nmc.frames import refused

TICK_S: Final = 0.512e-3
"""Servo tick with a servo rate divisor of 1."""
_ONE: Final = 65536
_MAX_WORD: Final = 0xFFFF_FFFF


def _word(value: float, what: str) -> int:
    if not isfinite(value) or not 0.0 <= value <= _MAX_WORD:
        raise refused(f"{what} of {value} must be finite, not negative, and fit 32 bits")
    return round(value)


def velocity_word(velocity_counts_per_s: float, servo_rate_divisor: int = 1) -> int:
    """The u32 for a velocity magnitude.

    Raises:
        RefusedError: It is negative, not finite, or does not fit.
    """
    return _word(velocity_counts_per_s * _ONE * TICK_S * servo_rate_divisor, "velocity word")


def acceleration_word(acceleration_counts_per_s2: float, servo_rate_divisor: int = 1) -> int:
    """The u32 for an acceleration magnitude.

    Raises:
        RefusedError: It is negative, not finite, or does not fit.
    """
    return _word(acceleration_counts_per_s2 * _ONE * (TICK_S * servo_rate_divisor) ** 2, "acceleration word")


def velocity_counts_per_s(word: int, servo_rate_divisor: int = 1) -> float:
    """The velocity magnitude of a word."""
    return word / (_ONE * TICK_S * servo_rate_divisor)


def acceleration_counts_per_s2(word: int, servo_rate_divisor: int = 1) -> float:
    """The acceleration magnitude of a word."""
    return word / (_ONE * (TICK_S * servo_rate_divisor) ** 2)


def path_point(step_counts: int, *, scale: int, lower_rate: bool) -> int:
    """One u16 of ADD_PATHPOINT. FACT: libnmc.

    Args:
        step_counts: Signed counts to go until the next point.
        scale: 4 at 30 Hz and 8 at 60 Hz, or with the fast-path output bit 8 at 60 Hz and 16 at 120 Hz.
        lower_rate: The rate is the lower of the two that the module offers.

    Raises:
        RefusedError: The scale is unknown, or the step does not fit.
    """
    if scale not in (4, 8, 16):
        raise refused(f"path scale {scale} is none of 4, 8, 16")
    word = abs(step_counts) * scale
    if word > 0xFFFF:
        raise refused(f"path step of {step_counts} counts, {0xFFFF // scale} at most")
    return word | lower_rate << 1 | (step_counts < 0)
