"""FORCES and MOMENTS made one reading.

FACT (jr3-mbed-firmware-can main.cpp): a reading is sent as two CAN frames with the same frame counter, forces first.
Only frames with equal counters belong together; half a reading is never mixed with half of another.
"""

from __future__ import annotations

from palpate.drivers.jr3.messages import Forces, Moments, Reading


class PairJoiner:
    """Joins halves in either order and keeps at most one of each kind waiting.

    Attributes:
        orphans: Halves whose other half never came.
        duplicates: Halves that came twice.
    """

    def __init__(self) -> None:
        self.orphans = 0
        self.duplicates = 0
        self._forces: Forces | None = None
        self._moments: Moments | None = None

    def clear(self) -> None:
        """Forget the halves that wait; after a restart equal counters mean nothing."""
        self.orphans += (self._forces is not None) + (self._moments is not None)
        self._forces = self._moments = None

    def add(self, half: Forces | Moments) -> Reading | None:
        """Take one half; give back the reading that it completes, or None."""
        if isinstance(half, Forces):
            self._displaced(self._forces, half.counter)
            self._forces = half
        else:
            self._displaced(self._moments, half.counter)
            self._moments = half
        forces, moments = self._forces, self._moments
        if forces is None or moments is None or forces.counter != moments.counter:
            return None
        self._forces = self._moments = None
        return Reading(forces.counts, moments.counts, half.counter)

    def _displaced(self, waiting: Forces | Moments | None, counter: int) -> None:
        if waiting is None:
            return
        if waiting.counter == counter:
            self.duplicates += 1
        else:
            self.orphans += 1
