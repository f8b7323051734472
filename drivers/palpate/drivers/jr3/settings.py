"""What a user may choose, and checks that say what would be right."""

from collections.abc import Iterable
from dataclasses import dataclass
from math import isfinite, pi

from palpate.drivers.errors import SettingError
from palpate.drivers.jr3.messages import LEFT_HANDED, Signs, check_signs

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
        if not isfinite(self.cutoff_Hz) or not (self.cutoff_Hz == 0.0 or 0.01 <= self.cutoff_Hz <= MAX_CUTOFF_HZ):
            remedy = f"choose 0 for unfiltered, or 0.01 to {MAX_CUTOFF_HZ} Hz"
            raise SettingError("JR3", f"a cut-off of {self.cutoff_Hz} Hz does not exist", remedy)
        if not 0 < self.period_us <= MAX_PERIOD_US:
            raise SettingError("JR3", f"a period of {self.period_us} us is no use", f"choose 1 to {MAX_PERIOD_US} us")
        if self.stall_periods < 2:
            problem = f"{self.stall_periods} periods of silence happen all the time"
            raise SettingError("JR3", problem, "choose stall_periods of 2 or more; 20 is usual")
        check_signs(self.signs)

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
    if not 1 <= node <= 127:
        raise SettingError("JR3 on CAN", f"node {node} does not exist", "choose 1 to 127, as compiled into the board")
    taken = set(canopen_nodes)
    if node in taken:
        free = next((n for n in range(127, 0, -1) if n not in taken), None)
        problem = f"node {node} is also a CANopen device, and their identifiers are the same"
        raise SettingError("JR3 on CAN", problem, f"compile another node number into the board, for example {free}")
