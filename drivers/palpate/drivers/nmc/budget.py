"""What the line allows: time of an exchange, of a cycle over all axes, and the rates that fit. CALC throughout."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from palpate.drivers.errors import SettingError
from palpate.drivers.nmc.frames import Command, Item
from palpate.drivers.nmc.replies import reply_size_bytes

BITS_PER_BYTE: Final = 10
"""One start bit, eight data bits, one stop bit."""
LOOP_RATE_HZ: Final = 140.0
"""Rate of the control loop; an arm that cannot follow it runs at a whole fraction."""
_SLOWEST_FRACTION: Final = 140


@dataclass(frozen=True, slots=True)
class LineTiming:
    """The line and the adapter.

    Attributes:
        baud: Line rate, bit/s.
        adapter_latency_s: What the adapter adds to every exchange.
        turnaround_s: What a module takes before it answers.
    """

    baud: int
    adapter_latency_s: float = 0.0
    turnaround_s: float = 0.0

    def wire_s(self, size_bytes: int) -> float:
        """Time of so many bytes on the wire."""
        return size_bytes * BITS_PER_BYTE / self.baud

    def exchange_s(self, size_bytes: int) -> float:
        """Time of an exchange of so many bytes, both ways together; the next may only begin after it."""
        return self.wire_s(size_bytes) + self.adapter_latency_s + self.turnaround_s


def exchange_size_bytes(command: Command, mask: Item) -> int:
    """Bytes of the command and of its reply."""
    return command.size_bytes + reply_size_bytes(mask)


@dataclass(frozen=True, slots=True)
class CycleBudget:
    """One cycle: an exchange, or several, with every axis.

    Attributes:
        line: The line.
        exchange_sizes_bytes: Size of each exchange of the cycle, both ways.
        reserve: Share of the period that is to stay free, for an operating system that is late.
    """

    line: LineTiming
    exchange_sizes_bytes: tuple[int, ...]
    reserve: float = 0.0

    @property
    def cycle_s(self) -> float:
        """Time that one cycle takes at least."""
        return sum(self.line.exchange_s(size) for size in self.exchange_sizes_bytes)

    @property
    def max_rate_Hz(self) -> float:
        """The highest rate that leaves the reserve."""
        return (1.0 - self.reserve) / self.cycle_s

    def fitting_rates_Hz(self, base_Hz: float = LOOP_RATE_HZ) -> tuple[float, ...]:
        """The whole fractions of the base rate that fit, the highest first."""
        fractions = (base_Hz / divisor for divisor in range(1, _SLOWEST_FRACTION + 1))
        return tuple(rate for rate in fractions if rate <= self.max_rate_Hz)

    def require(self, rate_Hz: float) -> None:
        """Refuse a rate that does not fit.

        Raises:
            SettingError: It does not fit; the message has the numbers and the rates that do.
        """
        if 0.0 < rate_Hz <= self.max_rate_Hz:
            return
        size, count = sum(self.exchange_sizes_bytes), len(self.exchange_sizes_bytes)
        rates = ", ".join(f"{rate:.4g}" for rate in self.fitting_rates_Hz()[:4]) or "none"
        problem = (
            f"a cycle at {rate_Hz:.4g} Hz does not fit: {count} exchanges, {size} bytes in all at"
            f" {self.line.baud} baud, each with {self.line.adapter_latency_s * 1e3:.3g} ms adapter latency and"
            f" {self.line.turnaround_s * 1e3:.3g} ms turnaround, take {self.cycle_s * 1e3:.2f} ms,"
            f" so {self.max_rate_Hz:.4g} Hz at most with {self.reserve:.0%} in reserve"
        )
        raise SettingError("NMC bus", problem, f"choose a fitting fraction of {LOOP_RATE_HZ:.4g} Hz: {rates}")


def same_for_all(line: LineTiming, axes: int, sizes_bytes: Sequence[int], reserve: float = 0.0) -> CycleBudget:
    """The budget of a cycle that has the same exchanges with every axis.

    Args:
        line: The line.
        axes: Number of axes.
        sizes_bytes: Size of each exchange with one axis, both ways.
        reserve: Share of the period that is to stay free.
    """
    return CycleBudget(line, tuple(sizes_bytes) * axes, reserve)
