"""Settings of a servo module over the bus."""

from __future__ import annotations

import struct
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class GainParameters:
    """Parameters of SET_GAIN, all zero at power-up, so that the servo cannot move anything (INFERENCE).

    Attributes:
        kp: Proportional gain; with 0 the motor does not follow.
        kd: Derivative gain, without effect here, because the plant represents the closed loop.
        output_limit: Largest duty, 0 to 255; with 0 the motor does not follow.
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
        """Whether a motor with these gains follows its set-point."""
        return self.kp != 0 and self.output_limit > 0

    @classmethod
    def decoded(cls, data: bytes) -> GainParameters:
        """Return the parameters in the 14 data bytes of SET_GAIN; the last compensates a dead band (FACT, libnmc)."""
        kp, kd, ki, il, ol, cl, el, sr, _ = struct.unpack("<hhhhBBhBB", data[:14])
        return cls(kp, kd, ki, il, ol, cl, el, max(sr, 1))
