"""The firmware of a JR3 force/torque node, without its wire."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from enum import Enum, IntEnum, auto

from palpate.simulation.emulators.jr3.sensor import (
    LARGEST_COUNTS,
    WRIST_FULL_SCALES,
    ACQUISITION_PERIOD_ns,
    Jr3Config,
    SHORTEST_PERIOD_ns,
    counts_of,
    smoothed,
    smoothing_factor,
)

WrenchSource = Callable[[int], Iterable[float]]
"""Gives the true wrench at a time in ns: Fx, Fy, Fz in N and Mx, My, Mz in N m, right-handed."""

_COUNTER_MODULUS = 65536
_FRESH_WORDS = (0xA5A5,) * 6


def unsigned(data: bytes, offset: int, size: int) -> int:
    """Little-endian number, or 0 where the payload is too short. FACT: jr3-mbed-firmware-can main.cpp."""
    return int.from_bytes(data[offset : offset + size], "little") if len(data) >= offset + size else 0


class BoardState(IntEnum):
    """State byte of an acknowledgement. FACT: jr3-mbed-firmware-can main.cpp."""

    READY = 0
    NOT_INITIALISED = 1


class Notice(Enum):
    """What the firmware reports besides samples."""

    BOOTED = auto()


class _Phase(Enum):
    BOOTING = auto()
    READING_EEPROM = auto()
    SERVING = auto()


@dataclass(frozen=True, slots=True)
class Sample:
    """One reading as it goes on the wire.

    Attributes:
        counts: Six signed 16-bit counts; 16384 is one full scale.
        counter: Acquisitions since START, modulo 65536.
    """

    counts: tuple[int, ...]
    counter: int


class Jr3Node:
    """Sampling, filtering, zeroing and streaming, driven by the time it is told.

    The first time it is given is the time of power-up. The input is taken once a step and held for all acquisitions
    since the step before, so a load that changes quickly needs short steps.
    """

    def __init__(self, config: Jr3Config, wrench: WrenchSource) -> None:
        self.config = config
        self.silent = False
        """Whether nothing that the node sends reaches the wire."""
        self.connected = config.connected
        """Whether the sensor is plugged into the board. Without it acquisitions stop and streams repeat themselves
        (INFERENCE from the threads of jr3-mbed-firmware Jr3Controller.cpp)."""
        self._wrench = wrench
        self._alpha = 1.0
        self._power_ns: int | None = None
        self._power_down()

    def _power_down(self) -> None:
        self._phase = _Phase.BOOTING
        self._phase_ends_ns = 0
        self.state = BoardState.NOT_INITIALISED
        self._stop_sampling()

    def _stop_sampling(self) -> None:
        self._sampling = False
        self._next_acquisition_ns = 0
        self._counter = 0
        self._offset = [0.0] * 6
        self._filtered = [0.0] * 6
        self._zero_sample_due = False
        self._next_sample_ns: int | None = None
        self._period_ns = 0

    @property
    def listening(self) -> bool:
        """Whether the board has opened its wire; before that it loses what it is sent."""
        return self._phase is not _Phase.BOOTING

    @property
    def serving(self) -> bool:
        """Whether the main loop runs, rather than waiting for the sensor's calibration."""
        return self._phase is _Phase.SERVING

    def reboot(self, now_ns: int) -> None:
        """Cut the power for a moment: everything is forgotten and the boot sequence begins."""
        self._power_down()
        self._power_ns = now_ns
        self._phase_ends_ns = now_ns + self.config.boot_ns

    def advance(self, now_ns: int) -> list[Sample | Notice]:
        """Let time pass; samples of the asynchronous stream and notices, in the order in which they came."""
        if self._power_ns is None:
            self.reboot(now_ns)
        happened: list[Sample | Notice] = []
        while True:
            if self._phase is not _Phase.SERVING:
                if not self._end_phase(now_ns, happened):
                    break
            elif self._next_sample_ns is not None and self._next_sample_ns <= now_ns:
                self._acquire_until(self._next_sample_ns)
                happened.append(self._sample())
                self._next_sample_ns += self._period_ns
            else:
                self._acquire_until(now_ns)
                break
        return happened

    def _end_phase(self, now_ns: int, happened: list[Sample | Notice]) -> bool:
        waits_for_sensor = self._phase is _Phase.READING_EEPROM and not self.connected
        if waits_for_sensor:
            # Reading blocks; what was read before counts for nothing once the sensor is back.
            self._phase_ends_ns = now_ns + self.config.eeprom_ns
        if waits_for_sensor or self._phase_ends_ns > now_ns:
            return False
        if self._phase is _Phase.BOOTING and self.connected:
            self._phase = _Phase.READING_EEPROM
            self._phase_ends_ns += self.config.eeprom_ns
            return True
        if self._phase is _Phase.READING_EEPROM:
            self.state = BoardState.READY
            happened.append(Notice.BOOTED)
        self._phase = _Phase.SERVING
        return True

    def _acquire_until(self, now_ns: int) -> None:
        if not self._sampling or now_ns < self._next_acquisition_ns:
            return
        acquisitions = (now_ns - self._next_acquisition_ns) // ACQUISITION_PERIOD_ns + 1
        self._next_acquisition_ns += acquisitions * ACQUISITION_PERIOD_ns
        if self.connected:
            self._filtered = smoothed(self._filtered, counts_of(self._wrench(now_ns)), self._alpha, acquisitions)
            self._counter = (self._counter + acquisitions) % _COUNTER_MODULUS

    def _sample(self) -> Sample:
        if self._zero_sample_due:
            self._zero_sample_due = False
            return Sample((0,) * 6, self._counter)
        counts = [round(value - zero) for value, zero in zip(self._filtered, self._offset, strict=True)]
        return Sample(tuple(min(max(count, -LARGEST_COUNTS), LARGEST_COUNTS) for count in counts), self._counter)

    def start(self, cut_off_cHz: int, now_ns: int, period_us: int) -> None:
        """Start sampling, or retune it if it runs; nothing happens unless the node is ready.

        A start after a stop has no offsets and a filter at zero (FACT: they are local to the sampling thread,
        jr3-mbed-firmware Jr3Controller.cpp). While sampling, only cut-off and period change (INFERENCE, same source).
        The first sample of a stream comes one acquisition after the start (assumed).

        Args:
            cut_off_cHz: Cut-off of the filter in hundredths of a hertz; 0 for none.
            now_ns: Time, ns.
            period_us: Period of the stream, us. The mode that sends on SYNC is not emulated.
        """
        if self.state is not BoardState.READY:
            return
        self._alpha = smoothing_factor(cut_off_cHz)
        if not self._sampling:
            self._sampling = True
            self._next_acquisition_ns = now_ns + ACQUISITION_PERIOD_ns
        self._period_ns = max(period_us * 1000, SHORTEST_PERIOD_ns)
        self._next_sample_ns = now_ns + ACQUISITION_PERIOD_ns

    def stop(self) -> None:
        """Stop sampling: zero, filter and frame counter are lost. FACT: jr3-mbed-firmware Jr3Controller.cpp."""
        if self.state is BoardState.READY:
            self._stop_sampling()

    def zero(self) -> None:
        """Take the filtered value as the new zero; the next sample on the wire is zero on all axes.

        FACT (jr3-mbed-firmware Jr3Controller.cpp): the filtered value is taken, and one all-zero sample comes out.
        INFERENCE: that it is the next one sent. Without sampling there is nothing to zero (assumed).
        """
        if self._sampling:
            self._offset = self._filtered
            self._zero_sample_due = True

    def full_scale_words(self) -> tuple[int, ...]:
        """Six unsigned 16-bit words of a full-scale answer.

        FACT (jr3-mbed-firmware-can main.cpp): a node that is not ready leaves the buffer as it was, so the words are
        whatever was in it before; what a fresh buffer holds is assumed.
        """
        return WRIST_FULL_SCALES if self.state is BoardState.READY else _FRESH_WORDS
