"""Readings of before under new numbers: where a sensor's noise is above its step, no reading comes twice by chance."""

from collections import deque
from collections.abc import Sequence
from typing import Final

from palpate.drivers.device import ForceSample

_KNOWN: Final = 300
"""So many readings show whether its noise is above its step."""
_KEPT: Final = 1024
_LEAST, _AS_LONG = 5, 4
"""So many in a row, and so many times as many as ever before, are no chance."""
_SELDOM: Final = 0.01
"""Where more readings than this share come again, its step is coarse, and nothing is told by that."""


class Repetition:
    """All channels of the newest readings held against those of before.

    Args:
        most_ns: What comes again for longer than this is told; 0 asks for nothing.
    """

    def __init__(self, most_ns: int) -> None:
        self._most_ns = most_ns
        self._count = self._again = self._run = self._lag = self._longest = 0
        self._is_told = False
        self._numbers: dict[tuple[float, ...], int] = {}
        self._kept: deque[tuple[float, ...]] = deque()

    def told(self, samples: Sequence[ForceSample], period_ns: int) -> str | None:
        """What is wrong with these readings after those of before; None while nothing is.

        Args:
            period_ns: Time between two of them.
        """
        if not self._most_ns:
            return None
        for sample in samples:
            self._note((*sample.force_N, *sample.torque_Nm))
        most = max(_LEAST, round(self._most_ns / period_ns), _AS_LONG * self._longest)
        before = self._count - self._run
        if self._run < most or before < _KNOWN or self._again - self._run > _SELDOM * before:
            return None
        self._is_told = True
        return (
            f"its last {self._run} readings are those of {self._lag * period_ns * 1e-6:.0f} ms before in each digit,"
            " under new numbers; see what stands between it and this computer, and power it again"
        )

    def _note(self, reading: tuple[float, ...]) -> None:
        self._count += 1
        lag = self._count - self._numbers.get(reading, self._count)
        if not lag or lag != self._lag:
            self._ended()
        self._lag = lag
        if lag:
            self._run, self._again = self._run + 1, self._again + 1
        self._numbers[reading] = self._count
        self._kept.append(reading)
        if len(self._kept) > _KEPT:
            oldest = self._kept.popleft()
            if self._numbers.get(oldest) == self._count - _KEPT:
                del self._numbers[oldest]

    def _ended(self) -> None:
        if self._is_told:
            self._again -= self._run
        else:
            self._longest = max(self._longest, self._run)
        self._run, self._is_told = 0, False
