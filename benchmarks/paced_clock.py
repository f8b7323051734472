"""Real time for the simulated work cell, so that it can be driven like a real one."""

from __future__ import annotations

from typing import Final

from palpate.adapters.hardware.clock import MonotonicClock
from palpate.core.ports.devices import Clock
from palpate.core.ports.values import CONTROL_RATE_HZ
from palpate.simulation.work_cell.cell import WorkCell

_NS: Final = 1_000_000_000
_MADE_UP_NS: Final = _NS // 10
"""Physics that is behind by more than this is not made up for: as after a pause between trials."""


class PacedClock(Clock):
    """Sleeps in real time, and moves the simulated cell on with it.

    Time is counted on the cell's own scale, so that its samples' times compare. Physics runs ahead to the last tick of
    the cell before a deadline, in the time that would be slept anyway; a sample is therefore up to one tick old, and
    never of the future.

    Args:
        cell: The work cell; nothing else moves it.
        real: Real time; None takes the system's monotonic clock.
    """

    def __init__(self, cell: WorkCell, real: Clock | None = None) -> None:
        self._cell, self._real = cell, real if real is not None else MonotonicClock()
        self._offset_ns = cell.time_ns - self._real.now_ns()

    def now_ns(self) -> int:
        """See :class:`Clock`."""
        now = self._real.now_ns() + self._offset_ns
        if now < self._cell.time_ns:
            # Somebody set the cell's clock, as when a run is resumed.
            self._offset_ns += self._cell.time_ns - now
            return self._cell.time_ns
        return now

    def sleep_until(self, deadline_ns: int) -> None:
        """See :class:`Clock`."""
        cell, now = self._cell, self.now_ns()
        if now - cell.time_ns > _MADE_UP_NS:
            cell.set_ticks(_newest_tick(now))
        last = _newest_tick(deadline_ns)
        while cell.ticks < last:
            cell.advance()
        self._real.sleep_until(deadline_ns - self._offset_ns)


def _newest_tick(time_ns: int) -> int:
    """The last of the cell's ticks whose time, rounded down to whole nanoseconds, is not after this one."""
    return ((time_ns + 1) * CONTROL_RATE_HZ - 1) // _NS
