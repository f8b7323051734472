"""Readings made samples: what is new, what it means, and what must be said with it."""

from palpate.drivers.jr3.messages import (
    FULL_SCALE_COUNTS,
    NEAR_SATURATION_COUNTS,
    SATURATION_COUNTS,
    FullScales,
    Jr3Sample,
    Reading,
    Scaling,
    Signs,
    peak_counts,
)

ACQUISITION_S = 128.5e-6
"""Seconds between acquisitions. CALC from the sensor's frame rate."""

_WRAP, _HALF = 0x10000, 0x8000
_PLAUSIBLE_STEPS = 8.0
_MISSED_STEPS = 1.5
_BORNE_COUNTS, _ZERO_COUNTS = 128, 48
"""What shows on some channel of a sensor that bears a tool, and what noise may show of one just zeroed. Assumed; CALC,
with the scales of a wrist sensor: 0.9 to 1.4 N and 0.3 to 0.5 N."""
_SOON_NS = 100_000_000


class FrameCounter:
    """Unwraps the counter and counts what is missing.

    Attributes:
        missed: How many (CALC from the counter and the period).
        restarts: How often the counter went back without our asking. The zero is gone then too.
    """

    def __init__(self, period_us: int) -> None:
        self.duplicates = self.doubted = self.gaps = self.missed = self.restarts = 0
        self._step = max(1.0, period_us * 1e-6 / ACQUISITION_S)
        self._window = int(_PLAUSIBLE_STEPS * self._step) + 1
        self._sequence = 0
        self._last: int | None = None
        self._doubtful: int | None = None
        self._resuming = False

    def restart(self) -> None:
        """The board begins again (START, BOOTUP): the next counter may be any; the sequence continues."""
        self._last = self._doubtful = None

    def resume(self) -> None:
        """Nothing came for so long that the counter may have wrapped: the next new one may be any."""
        self._resuming = True

    def accept(self, counter: int) -> int | None:
        """Take the counter of a reading.

        Returns:
            Its sequence number, higher than all before by the number of acquisitions where that is known; None when the
            reading is a duplicate or in doubt.
        """
        last = self._last
        if last is None:
            return self._continue(counter, 1)
        ahead = (counter - last) % _WRAP
        if ahead == 0:
            self.duplicates += 1
            return None
        if self._resuming:
            return self._continue(counter, 1)
        if ahead <= self._window:
            self._note_gap(ahead)
            return self._continue(counter, ahead)
        if self._doubtful is None or not 0 < (counter - self._doubtful) % _WRAP <= self._window:
            self._doubtful = counter
            self.doubted += 1
            return None
        if ahead < _HALF:
            self._note_gap(ahead)
            return self._continue(counter, ahead)
        if (last - counter) % _WRAP > self._window:
            self.restarts += 1
        return self._continue(counter, 1)

    def _continue(self, counter: int, ahead: int) -> int:
        self._last, self._doubtful, self._resuming = counter, None, False
        self._sequence += ahead
        return self._sequence

    def _note_gap(self, ahead: int) -> None:
        if ahead > _MISSED_STEPS * self._step:
            self.gaps += 1
            self.missed += round(ahead / self._step) - 1


class Sampler:
    """Makes samples and remembers what marks they bear.

    Attributes:
        full_scales: As the board reports them; None before.
        full: Readings near the end of the scale.
        unasked_ns: When the board last answered without a request of ours.
        was_zeroed: Right after such an answer all channels went to 0 at once: another client has set the zero.
    """

    def __init__(self, period_us: int, settling_ns: int, signs: Signs) -> None:
        self.counter = FrameCounter(period_us)
        self.full_scales: FullScales | None = None
        self.after_boot = self.was_zeroed = False
        self._peak, self.unasked_ns = 0, -_SOON_NS
        self.samples = self.last_new_ns = self.full = 0
        self._signs, self._settling_ns = signs, settling_ns
        self._scaling: Scaling | None = None
        self._settled_at_ns = 0

    def scale_by(self, full_scales: FullScales) -> None:
        """Use these full scales from now on."""
        self.full_scales, self._scaling = full_scales, Scaling(full_scales, self._signs)

    def started(self, now_ns: int) -> None:
        """The board has started a stream; its filter begins at 0."""
        self.counter.restart()
        self.last_new_ns, self._settled_at_ns = now_ns, now_ns + self._settling_ns

    def take(self, reading: Reading, now_ns: int) -> Jr3Sample | None:
        """A sample of a reading; None when that is no news, or in doubt."""
        if self._scaling is None:
            return None
        restarts = self.counter.restarts
        sequence = self.counter.accept(reading.counter)
        if sequence is None:
            return None
        if self.counter.restarts > restarts:
            self._settled_at_ns = now_ns + self._settling_ns
        self.last_new_ns = now_ns
        peak = peak_counts(reading)
        self.full += peak > NEAR_SATURATION_COUNTS
        was, self._peak = self._peak, peak
        is_soon = now_ns - self.unasked_ns < _SOON_NS
        self.was_zeroed |= was >= _BORNE_COUNTS and peak < _ZERO_COUNTS and is_soon
        force_N, torque_Nm = self._scaling.wrench(reading)
        self.samples += 1
        return Jr3Sample(
            force_N,
            torque_Nm,
            sequence,
            now_ns,
            counter=reading.counter,
            over_range=peak > FULL_SCALE_COUNTS,
            near_saturated=peak > NEAR_SATURATION_COUNTS,
            saturated=peak >= SATURATION_COUNTS,
            settling=now_ns < self._settled_at_ns,
            after_boot=self.after_boot,
        )
