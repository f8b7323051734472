"""Settings for the bus, its baud rates, and the duration of an exchange."""

from dataclasses import dataclass
from typing import Final

POWER_UP_BAUD: Final = 19_200
"""Baud rate of every module after power-up and after HARD_RESET. FACT: libnmc."""

BAUD_DIVISORS: Final = {19_200: 63, 57_600: 20, 115_200: 10, 230_400: 5, 250_000: 4}
"""SET_BAUD data byte for each baud rate.

FACT (libnmc): the first three. FACT (another driver): 230 400. CALC: all fit 1.25 MHz / (divisor + 1) within 3.5 %,
except 230 400, which would actually be 208 333 (-9.6 %): too far off for a UART, unless the modules have a different
clock. INFERENCE from the same formula: 250 000, which it meets exactly.
"""


@dataclass(frozen=True)
class BusSettings:
    """Settings for communication with the modules.

    Attributes:
        baud: Baud rate to use after start-up, bit/s.
        adapter_latency_s: Time that the serial adapter adds to every exchange: about 0 for a UART, 0.001 for an FTDI
            adapter in low-latency mode, 0.016 by default.
        slack_s: Additional delay accepted for a reply, to allow for the operating system.
        reset_wait_s: Wait after HARD_RESET. INFERENCE: 0.1; the Linux port of libnmc mistakenly waits 0.1 ms.
    """

    baud: int = 115_200
    adapter_latency_s: float = 0.001
    slack_s: float = 0.02
    reset_wait_s: float = 0.1


ERRORS_IN_A_ROW: Final = 2
"""Number of consecutive failures, at one module or on the whole bus, that requires a restart. FACT (libnmc)."""
MAX_MODULES: Final = 31
"""Maximum number of modules in the address chain. INFERENCE."""
BITS_PER_BYTE: Final = 10
"""Bits per byte on the line: one start bit, eight data bits and one stop bit."""


@dataclass(frozen=True, slots=True)
class SerialTiming:
    """Timing of the serial line and its adapter.

    Attributes:
        adapter_latency_s: Latency that the adapter adds to every exchange. NOT FOUND: response time of a module.
    """

    baud: int
    adapter_latency_s: float = 0.0

    def wire_s(self, size_bytes: int) -> float:
        """Return the transmission time for this number of bytes."""
        return size_bytes * BITS_PER_BYTE / self.baud

    def exchange_s(self, size_bytes: int) -> float:
        """Return the duration of an exchange with this total number of bytes; exchanges must not overlap."""
        return self.wire_s(size_bytes) + self.adapter_latency_s
