"""What can be set on a servo module: gains over the bus, the rest when it is built."""

from __future__ import annotations

import enum
import struct
from dataclasses import dataclass
from typing import Final

WATCHDOG_UNIT_NS: Final = 8_192_000
"""Unit of the watchdog's time (FACT, Logosol manuals: 8192 us)."""


class WatchdogAction(enum.Enum):
    """What an expired watchdog does (FACT, Logosol manuals)."""

    OFF = "off"
    DISABLE = "disable"
    SMOOTH_STOP_AND_DISABLE = "smooth stop and disable"
    SMOOTH_STOP = "smooth stop"


@dataclass(frozen=True, slots=True)
class ModuleSettings:
    """How a module is built and wired.

    Attributes:
        watchdog_units: Time without an intact command after which the watchdog acts, in units of 8192 us.
        watchdog_action: What it does then. The classic command set has none, so it is off by default.
        analog: The A/D item, 0 to 255 (assumed constant).
        index_counts: Encoder counts between index pulses (INFERENCE: 500 lines, quadrature).
    """

    version: int = 10
    watchdog_units: int = 0
    watchdog_action: WatchdogAction = WatchdogAction.OFF
    analog: int = 0
    index_counts: int = 2000

    def __post_init__(self) -> None:
        if self.watchdog_action is not WatchdogAction.OFF and self.watchdog_units < 1:
            raise ValueError("a watchdog that acts needs watchdog_units of at least 1")


@dataclass(frozen=True, slots=True)
class GainParameters:
    """Parameters of SET_GAIN, all zero at power-up, when the servo therefore cannot move anything (INFERENCE).

    Attributes:
        kp: Proportional gain; with 0 the motor does not follow.
        kd: Derivative gain, without effect here: the plant stands for the closed loop.
        output_limit: Largest duty, 0 to 255; with 0 the motor does not follow.
        current_limit: Limit of the motor's current, without effect here.
        error_limit: Position error in counts at which the servo switches itself off.
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
        """Whether a motor under these gains follows its set-point at all."""
        return self.kp != 0 and self.output_limit > 0

    @classmethod
    def decoded(cls, data: bytes) -> GainParameters:
        """From the 14 data bytes of SET_GAIN, whose last one compensates a dead band (FACT, libnmc)."""
        kp, kd, ki, il, ol, cl, el, sr, _ = struct.unpack("<hhhhBBhBB", data[:14])
        return cls(kp, kd, ki, il, ol, cl, el, max(sr, 1))
