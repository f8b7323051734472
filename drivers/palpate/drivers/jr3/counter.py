"""The board's 16-bit frame counter made a sequence number that only ever increases.

FACT (Jr3Controller.cpp of jr3-mbed-firmware): the counter goes up by one per acquisition of six axes, not per reading
sent, and STOP sets it back to zero. CALC: acquisitions are 128.5 us apart, 7782 Hz, so it wraps every 8.42 s and
readings 10 ms apart differ by about 78.

A counter that does not continue the last one is not believed until the next one continues it in turn. On a line without
a checksum this keeps a flipped bit from looking like a restart, and costs one reading at a true one. A step back by
less than eight readings is a correction, not a restart: the counter before it was damaged. (A board that restarts
unannounced with its counter that low is taken for such a correction; it has not streamed for long enough to hold a
zero, or its counter has wrapped at just that moment, which is a chance of 1 % at 10 ms.)
"""

from __future__ import annotations

ACQUISITION_S = 128.5e-6
"""Seconds between acquisitions. CALC from the sensor's frame rate."""

_WRAP, _HALF = 0x10000, 0x8000
_PLAUSIBLE_STEPS = 8.0
_MISSED_STEPS = 1.5


class FrameCounter:
    """Unwraps the counter and tells what is missing.

    Args:
        period_us: Time between readings that the board was told, in microseconds.

    Attributes:
        duplicates: Readings with the counter of the one before.
        doubted: Readings dropped because their counter fitted nothing before.
        gaps: How often readings were missing.
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
        """The board begins anew (START, BOOTUP): the next counter may be any; the sequence goes on."""
        self._last = self._doubtful = None

    def resume(self) -> None:
        """Nothing came for so long that the counter may have wrapped: the next new one may be any."""
        self._resuming = True

    def accept(self, counter: int) -> int | None:
        """Take the counter of a reading.

        Args:
            counter: 0 to 65535.

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
