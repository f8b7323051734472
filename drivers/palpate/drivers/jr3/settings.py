"""What a user may choose, and checks that say what would be right."""

from collections.abc import Iterable
from dataclasses import dataclass
from math import pi

from palpate.drivers.errors import require_all
from palpate.drivers.jr3.messages import LEFT_HANDED, Signs

MAX_CUTOFF_HZ = 655.35
"""Hz: 16 bits of 0.01 Hz (FACT, README of jr3-mbed-firmware-can)."""

MAX_PERIOD_US = 1_000_000
"""Longest time between readings that is accepted; the frame counter wraps after 8.42 s (CALC)."""

SETTLED_TAUS = 5.0
"""Time constants after which the filter counts as settled: 0.7 % of a step is left (CALC)."""


@dataclass(frozen=True, slots=True)
class Jr3Settings:
    """How the sensor is to be read. No default is documented anywhere: all are assumed.

    Attributes:
        cutoff_Hz: Cut-off of the board's first-order low-pass filter; 0 = unfiltered, otherwise 0.01 to 655.35.
        period_us: Time between readings, in microseconds.
        signs: See :data:`palpate.drivers.jr3.messages.LEFT_HANDED`.
        stall_periods: Periods without a new reading after which the sensor counts as silent.

    Raises:
        SettingError: A value that cannot work; says what would.
    """

    cutoff_Hz: float = 50.0
    period_us: int = 5000
    signs: Signs = LEFT_HANDED
    stall_periods: int = 20

    def __post_init__(self) -> None:
        cutoff = self.cutoff_Hz
        require_all(
            "JR3",
            (
                (cutoff == 0.0 or 0.01 <= cutoff <= MAX_CUTOFF_HZ, f"cutoff_Hz = {cutoff}", "0, or 0.01 to 655.35"),
                (0 < self.period_us <= MAX_PERIOD_US, f"period_us = {self.period_us}", f"1 to {MAX_PERIOD_US}"),
                (self.stall_periods >= 2, f"stall_periods = {self.stall_periods}", "2 at least"),
                (
                    len(self.signs) == 6 and all(sign in (-1, 1) for sign in self.signs),
                    f"signs = {self.signs}",
                    "+1 or -1 for Fx, Fy, Fz, Mx, My, Mz",
                ),
            ),
        )

    @property
    def cutoff_cHz(self) -> int:
        """The cut-off in hundredths of a hertz, as the board takes it."""
        return round(self.cutoff_Hz * 100.0)

    @property
    def stall_ns(self) -> int:
        """Silence, in ns, after which the sensor counts as silent."""
        return self.stall_periods * self.period_us * 1000


def settling_ns(cutoff_cHz: int) -> int:
    """Five time constants of the filter, in ns; 0 when unfiltered.

    CALC: the filter is of first order (FACT, Jr3Controller.cpp of jr3-mbed-firmware), tau = 1/(2 pi cut-off); 0.4 s at
        2 Hz.
    """
    return round(SETTLED_TAUS * 1e9 / (2.0 * pi * cutoff_cHz * 0.01)) if cutoff_cHz else 0


def check_node(node: int, canopen_nodes: Iterable[int] = ()) -> None:
    """Refuse a node number that cannot work on the bus.

    CALC: every identifier of the board is a multiple of 0x80 plus its node, and so is every identifier of a CANopen
        drive. With equal numbers the drive's emergency (0x080+n), TPDO1 (0x180+n), SDO (0x580+n, 0x600+n) and heartbeat
        (0x700+n) are taken for commands or readings: a TPDO2 (0x280+n) would stop the sensor and an RPDO2 (0x300+n)
        zero it.
    """
    taken = set(canopen_nodes)
    free = next((n for n in range(127, 0, -1) if n not in taken), None)
    require_all(
        "JR3 on CAN",
        (
            (1 <= node <= 127, f"node = {node}", "1 to 127, as compiled into the board"),
            (node not in taken, f"node = {node}", f"no CANopen device's on this bus, for example {free}"),
        ),
    )
