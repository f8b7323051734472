"""Firmware for a JR3 force/torque node, independent of the bus."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from enum import Enum, IntEnum, auto

from palpate.simulation.emulators.jr3 import sensor

WrenchSource = Callable[[int], Iterable[float]]
"""Function that returns the true wrench at a time in ns: Fx, Fy, Fz in N and Mx, My, Mz in N m, right-handed."""

_COUNTER_MODULUS = 65536
_FRESH_WORDS = (0xA5A5,) * 6
BOOT_NS = 2_033_000_000
"""Time from power-up until the calibration is loaded. FACT: jr3-mbed-firmware-can main.cpp, 2 s; CALC: 256 bytes,
one per acquisition."""


def unsigned(data: bytes, offset: int, size: int) -> int:
    """Return a little-endian number, or 0 if the payload is too short. FACT: jr3-mbed-firmware-can main.cpp."""
    return int.from_bytes(data[offset : offset + size], "little") if len(data) >= offset + size else 0


class BoardState(IntEnum):
    """State byte in an acknowledgement. FACT: jr3-mbed-firmware-can main.cpp."""

    READY = 0
    NOT_INITIALISED = 1


class Notice(Enum):
    """Reports from the firmware other than samples."""

    BOOTED = auto()


@dataclass(frozen=True, slots=True)
class Sample:
    """A reading: six signed 16-bit counts, 16384 at full scale, and the acquisition count since START, modulo 65536."""

    counts: tuple[int, ...]
    counter: int


class Jr3Node:
    """A node that samples, filters and streams, driven by the timestamps passed to its methods.

    The first timestamp is the time of power-up. The input is read once per step and used for all acquisitions since the
    previous step, so rapidly changing loads require short steps.

    Attributes:
        connected: Whether the sensor is plugged into the board. Without it, acquisitions stop and streams repeat the
            last sample (INFERENCE from the threads of jr3-mbed-firmware Jr3Controller.cpp).
        serving: Whether the board has booted; until then, it ignores received commands.
    """

    def __init__(self, wrench: WrenchSource, boot_ns: int = BOOT_NS) -> None:
        self.silent, self.connected = False, True
        self._wrench, self._boot_ns = wrench, boot_ns
        self._alpha = 1.0
        self._booted_ns: int | None = None
        self._power_down()

    def _power_down(self) -> None:
        self.serving, self.state = False, BoardState.NOT_INITIALISED
        self._stop_sampling()

    def _stop_sampling(self) -> None:
        self._sampling = False
        self._next_acquisition_ns = 0
        self._counter = 0
        self._filtered = [0.0] * 6
        self._next_sample_ns: int | None = None
        self._period_ns = 0

    def reboot(self, now_ns: int) -> None:
        """Interrupt the power. The state is lost, and the boot sequence begins."""
        self._power_down()
        self._booted_ns = now_ns + self._boot_ns

    def advance(self, now_ns: int) -> list[Sample | Notice]:
        """Advance the time. Return samples from the asynchronous stream and notices, in chronological order."""
        if self._booted_ns is None:
            self.reboot(now_ns)
        happened: list[Sample | Notice] = []
        if not self.serving and self._booted_ns is not None and self._booted_ns <= now_ns:
            self.serving = True
            if self.connected:
                self.state = BoardState.READY
                happened.append(Notice.BOOTED)
        while self._next_sample_ns is not None and self._next_sample_ns <= now_ns:
            self._acquire_until(self._next_sample_ns)
            happened.append(self._sample())
            self._next_sample_ns += self._period_ns
        self._acquire_until(now_ns)
        return happened

    def _acquire_until(self, now_ns: int) -> None:
        if not self._sampling or now_ns < self._next_acquisition_ns:
            return
        acquisitions = (now_ns - self._next_acquisition_ns) // sensor.ACQUISITION_PERIOD_ns + 1
        self._next_acquisition_ns += acquisitions * sensor.ACQUISITION_PERIOD_ns
        if self.connected:
            self._filtered = sensor.smoothed(
                self._filtered, sensor.counts_of(self._wrench(now_ns)), self._alpha, acquisitions
            )
            self._counter = (self._counter + acquisitions) % _COUNTER_MODULUS

    def _sample(self) -> Sample:
        counts = map(round, self._filtered)
        return Sample(
            tuple(min(max(count, -sensor.LARGEST_COUNTS), sensor.LARGEST_COUNTS) for count in counts), self._counter
        )

    def start(self, cut_off_cHz: int, now_ns: int, period_us: int) -> None:
        """Start sampling, or change the settings if already sampling. This has no effect unless the node is ready.

        A start after a stop begins with the filter at zero (FACT: it is local to the sampling thread, jr3-mbed-firmware
        Jr3Controller.cpp). While sampling, only the cut-off and the period change (INFERENCE, same source).
        The first sample of a stream comes one acquisition after the start (assumed).
        """
        if self.state is not BoardState.READY:
            return
        self._alpha = sensor.smoothing_factor(cut_off_cHz)
        if not self._sampling:
            self._sampling = True
            self._next_acquisition_ns = now_ns + sensor.ACQUISITION_PERIOD_ns
        self._period_ns = max(period_us * 1000, sensor.SHORTEST_PERIOD_ns)
        self._next_sample_ns = now_ns + sensor.ACQUISITION_PERIOD_ns

    def stop(self) -> None:
        """Stop sampling. The filter state and the frame counter are lost. FACT: jr3-mbed-firmware Jr3Controller.cpp."""
        if self.state is BoardState.READY:
            self._stop_sampling()

    def full_scale_words(self) -> tuple[int, ...]:
        """Return the six unsigned 16-bit words in a full-scale reply.

        FACT (jr3-mbed-firmware-can main.cpp): a node that is not ready does not change the buffer, so the words are its
        previous contents. The contents of a new buffer are assumed.
        """
        return sensor.WRIST_FULL_SCALES if self.state is BoardState.READY else _FRESH_WORDS
