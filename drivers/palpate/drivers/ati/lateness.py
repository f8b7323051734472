"""A box's own clock held against ours: does what it sends come later than it did?"""

from typing import Final

_WRAP: Final = 1 << 32
_DRIFT: Final = 1e-3
"""So far apart may two clocks run, ten times what crystals do: what grows late more slowly than that is not seen."""
_LASTS_NS: Final = 20_000_000
"""One look at what waited while this computer was away tells nothing of the way; nor does what makes up for a silence,
for as long as that was."""


class Lateness:
    """What counts samples at a known rate is a clock; the least time from it to ours is what the way takes.

    Args:
        rate_Hz: Of the count, 32 bits.
        most_ns: By how much later than that the newest may come.
    """

    def __init__(self, rate_Hz: float, most_ns: int) -> None:
        self._tick_ns, self._most_ns = 1e9 / rate_Hz, most_ns
        self._count = self._looked_ns = 0
        self._least_ns: float | None = None
        self._until_ns: int | None = None

    def persisting_ns(self, count: int, now_ns: int) -> int:
        """By how much the newest sample comes late, where it has come too late at each look for a while; else 0."""
        step = (count - self._count + _WRAP // 2) % _WRAP - _WRAP // 2
        away_ns = now_ns - self._looked_ns
        self._count, self._looked_ns = self._count + step, now_ns
        way_ns = now_ns - self._count * self._tick_ns
        # A count that goes back is that of a box which has restarted.
        known = self._least_ns is not None and step > 0
        self._least_ns = min((self._least_ns or 0.0) + _DRIFT * away_ns, way_ns) if known else way_ns
        late_ns = way_ns - self._least_ns
        if late_ns <= self._most_ns:
            self._until_ns = None
            return 0
        if self._until_ns is None or away_ns > _LASTS_NS:
            self._until_ns = now_ns + max(_LASTS_NS, away_ns)
        return round(late_ns) if now_ns >= self._until_ns else 0
