"""Path mode of a PIC-SERVO: a queue of short runs at constant velocity."""

from __future__ import annotations

from collections import deque
from typing import Final

CAPACITY: Final = 128
"""Points that the buffer holds (FACT, as used by libnmc)."""
_SLOW_TICKS: Final = 64  # 30 Hz, nominally: 64 ticks of 0.512 ms are 30.5 Hz (INFERENCE from whole ticks)


class PathBuffer:
    """The points of one module and the run under way.

    A point is a 16-bit word: bit 0 is the direction, bit 1 chooses the lower of two rates, the rest is a velocity.
    Distance times 4 at 30 Hz, 8 at 60 Hz or 16 at 120 Hz (FACT, libnmc) means that the upper 14 bits are always
    counts in 1/30 s, and that only the duration changes (CALC).

    Attributes:
        active: Path mode is on.
    """

    def __init__(self) -> None:
        self.active = False
        self._points: deque[int] = deque()
        self._velocity = 0
        self._ticks_left = 0

    def __len__(self) -> int:
        return len(self._points)

    def add(self, words: tuple[int, ...]) -> None:
        """Append points; those that find no room are lost (assumed)."""
        self._points.extend(words[: CAPACITY - len(self._points)])

    def start(self) -> None:
        """Begin to run what the buffer holds."""
        self.active, self._ticks_left = bool(self._points), 0

    def clear(self) -> None:
        """Leave path mode and forget every point."""
        self.active = False
        self._points.clear()
        self._ticks_left = 0

    def next_velocity(self, *, fast: bool) -> int | None:
        """Velocity for one tick in 1/65536 counts, or None when the path has ended; `fast` halves durations."""
        if self._ticks_left == 0:
            if not self._points:
                self.active = False
                return None
            word = self._points.popleft()
            speed = ((word >> 2) << 16) // _SLOW_TICKS
            self._velocity = -speed if word & 1 else speed
            ticks = _SLOW_TICKS if word & 2 else _SLOW_TICKS // 2
            self._ticks_left = ticks // 2 if fast else ticks
        self._ticks_left -= 1
        return self._velocity
