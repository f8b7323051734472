"""Settings of the bus, what is known of its baud rates, and the rates of cycles that the line allows."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite
from typing import Final

from palpate.drivers.device import BusBudget
from palpate.drivers.errors import require_all
from palpate.drivers.nmc.frames import GROUP_BIT, NmcCommand, StatusItem
from palpate.drivers.nmc.replies import reply_size_bytes

POWER_UP_BAUD: Final = 19_200
"""FACT (libnmc): where every module is after power-up and after HARD_RESET."""

BAUD_DIVISORS: Final = {19_200: 63, 57_600: 20, 115_200: 10, 230_400: 5, 250_000: 4}
"""Data byte of SET_BAUD by baud rate.

FACT (libnmc): the first three. FACT (another driver): 230 400. CALC: all of them fit 1.25 MHz / (divisor + 1) within
3.5 %, except 230 400, which would really be 208 333 (-9.6 %): too far for a UART, unless the modules have another
clock. INFERENCE from the same formula: 250 000, which it meets exactly.
"""


@dataclass(frozen=True, slots=True)
class BusSettings:
    """How to talk to the modules.

    Attributes:
        baud: Rate to change to after start-up, bit/s.
        adapter_latency_s: What the serial adapter adds to every exchange: about 0 for a UART, 0.001 for an FTDI
            adapter in low-latency mode, 0.016 for one as it comes.
        turnaround_s: Time a module takes before it answers. NOT FOUND, hence 0; ``palpate rig doctor`` measures it.
        slack_s: What a reply may be late beyond all that, for the operating system.
        errors_in_a_row: As many failures, at one module or on the whole bus, demand a new start. FACT (libnmc): 2.
        reset_wait_s: Wait after HARD_RESET. INFERENCE: 0.1; the port of libnmc to Linux waits 0.1 ms by mistake.
        max_modules: The address chain ends here at the latest. INFERENCE.

    Raises:
        SettingError: A value that cannot work.
    """

    baud: int = 115_200
    adapter_latency_s: float = 0.001
    turnaround_s: float = 0.0
    slack_s: float = 0.02
    errors_in_a_row: int = 2
    reset_wait_s: float = 0.1
    max_modules: int = 31

    def __post_init__(self) -> None:
        times = (self.adapter_latency_s, self.turnaround_s, self.slack_s, self.reset_wait_s)
        require_all(
            "NMC bus",
            (
                (self.baud in BAUD_DIVISORS, f"baud = {self.baud}", f"one of {', '.join(map(str, BAUD_DIVISORS))}"),
                (all(isfinite(t) and t >= 0.0 for t in times), f"times of {times} s", "finite and not negative"),
                (self.errors_in_a_row >= 1, f"errors_in_a_row = {self.errors_in_a_row}", "1 at least"),
                (1 <= self.max_modules < GROUP_BIT, f"max_modules = {self.max_modules}", "1 to 127"),
            ),
        )


BITS_PER_BYTE: Final = 10
"""One start bit, eight data bits, one stop bit."""


@dataclass(frozen=True, slots=True)
class SerialTiming:
    """The line and the adapter.

    Attributes:
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


def exchange_size_bytes(command: NmcCommand, mask: StatusItem) -> int:
    """Bytes of the command and of its reply."""
    return command.size_bytes + reply_size_bytes(mask)


def same_for_all(line: SerialTiming, axes: int, sizes_bytes: Sequence[int], reserve: float = 0.0) -> BusBudget:
    """The budget of a cycle that has the same exchanges with every axis.

    Args:
        sizes_bytes: Size of each exchange with one axis, both ways.
        reserve: Share of the period that is to stay free.
    """
    sizes = tuple(sizes_bytes) * axes
    cycle_s = sum(line.exchange_s(size) for size in sizes)
    load = (
        f"{len(sizes)} exchanges, {sum(sizes)} bytes in all at {line.baud} baud, each with"
        f" {line.adapter_latency_s * 1e3:.3g} ms adapter latency and"
        f" {line.turnaround_s * 1e3:.3g} ms turnaround, take {cycle_s * 1e3:.2f} ms"
    )
    return BusBudget("NMC bus", load, cycle_s, 1.0 - reserve)
