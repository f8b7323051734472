"""Settings of the bus, what is known of its baud rates, and the time of an exchange."""

from dataclasses import dataclass
from math import isfinite
from typing import Final

from palpate.drivers.errors import require_all
from palpate.drivers.nmc.frames import GROUP_BIT

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
