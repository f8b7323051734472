"""What fits on the wire: bits a cycle, and the highest rate that leaves room for everything else.

Standard knowledge (CAN 2.0A): a data frame with an 11-bit identifier and s data bytes is 44 + 8 s bits plus 3 of
interframe space; of these 34 + 8 s bits are subject to stuffing, at worst one bit for every four after the first.
CALC: 8 bytes make 111 bits, at worst 135; a PDO of 6 bytes 95, at worst 115.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Final

from palpate.drivers.errors import SettingError

LOOP_RATE_HZ: Final = 140
"""The control rate of the work cell; a drive cycle happens in each tick or in every k-th one."""

PDO_BYTES: Final = 6
"""Controlword or statusword, and one 32-bit figure."""

HIGHEST_LOAD: Final = 0.8
"""Share of the bus that cyclic frames may fill: SDO answers and repeated frames need the rest. A choice."""

_SLOWEST_DIVISOR: Final = 14


def frame_bits(data_bytes: int, *, stuffed: bool = True) -> int:
    """Bits of one data frame with an 11-bit identifier, interframe space included.

    Args:
        data_bytes: Payload, 0 to 8.
        stuffed: Count the worst case of stuff bits.
    """
    stuffing = (33 + 8 * data_bytes) // 4 if stuffed else 0
    return 47 + 8 * data_bytes + stuffing


@dataclass(frozen=True, slots=True)
class BusBudget:
    """The load that one arm puts on its bus.

    Attributes:
        drives: Number of drives.
        bitrate: In bit/s.
        heartbeat_s: Period of every drive's heartbeat, and of the host's.
        other_frames: Payloads, in bytes, of what other devices send in each cycle; (8, 8) for a JR3 in
            synchronous mode.
    """

    drives: int
    bitrate: int
    heartbeat_s: float
    other_frames: Sequence[int] = ()

    def bits_per_cycle(self, *, stuffed: bool = True) -> int:
        """Bits of the RPDOs, the SYNC, the TPDOs and other devices' frames of one cycle."""
        pdos = 2 * self.drives * frame_bits(PDO_BYTES, stuffed=stuffed)
        others = sum(frame_bits(size, stuffed=stuffed) for size in self.other_frames)
        return pdos + frame_bits(0, stuffed=stuffed) + others

    def highest_rate_Hz(self) -> float:
        """Cycles a second at which the worst case of stuffing fills the share that cyclic frames may have."""
        heartbeats = (self.drives + 1) * frame_bits(1) / self.heartbeat_s
        return max(0.0, HIGHEST_LOAD * self.bitrate - heartbeats) / self.bits_per_cycle()

    def require(self, rate_Hz: Fraction) -> None:
        """Refuse a cycle rate that is no whole fraction of the control rate, or does not fit.

        Raises:
            SettingError: With the numbers, and with the rates that would do.
        """
        highest = self.highest_rate_Hz()
        fitting = [k for k in range(1, _SLOWEST_DIVISOR + 1) if LOOP_RATE_HZ / k <= highest]
        remedy = f"{LOOP_RATE_HZ}/{fitting[0]} Hz would fit" if fitting else "use a faster bus"
        if rate_Hz <= 0 or (LOOP_RATE_HZ / rate_Hz).denominator != 1:
            problem = f"{float(rate_Hz):g} Hz is no whole fraction of the control rate of {LOOP_RATE_HZ} Hz"
            raise SettingError("CAN bus", problem, remedy)
        if rate_Hz > highest:
            problem = (
                f"{self.drives} drives need {self.bits_per_cycle()} bits a cycle at worst, so {self.bitrate} bit/s "
                f"carry {highest:.1f} cycles/s at {HIGHEST_LOAD:.0%} load, not {float(rate_Hz):g}"
            )
            raise SettingError("CAN bus", problem, remedy)
