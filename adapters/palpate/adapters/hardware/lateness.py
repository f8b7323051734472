"""A sensor's own clock held against ours: does what it sends come later than it did?"""

from typing import Final

from palpate.drivers.device import PolledSensor

LATE_NS: Final = 20_000_000
"""By so much later than they did samples may come, where a rig file does not say otherwise."""
_DRIFT: Final = 0.01
"""So far apart may the clocks run, more than crystals do: some rates are known by a calculation alone. What grows late
more slowly than that is not seen."""
_LASTS_NS: Final = 20_000_000
"""One look at what waited while this computer was away tells nothing of the way; nor does what makes up for a silence,
for as long as that was."""


class Lateness:
    """What counts samples at a known rate is a clock; the least time from it to ours is what the way takes.

    Args:
        most_ns: By how much later than that the newest sample may come; 0 asks for nothing.
    """

    def __init__(self, most_ns: int) -> None:
        self._most_ns = most_ns
        self._count = self._looked_ns = 0
        self._newest: int | None = None
        self._least_ns: float | None = None
        self._until_ns: int | None = None

    def told(self, device: PolledSensor, now_ns: int) -> str | None:
        """What is wrong where new samples have come too late at each look for a while; None while that is not so.

        Args:
            now_ns: When it was polled.
        """
        sample, count = device.latest, device.count
        if not self._most_ns or not device.count_Hz or sample is None or count is None:
            return None
        if sample.sequence == self._newest:
            return None
        self._newest = sample.sequence
        late_ns = self._persisting_ns(count, device.count_span, 1e9 / device.count_Hz, now_ns)
        if not late_ns:
            return None
        return (
            f"its samples come {late_ns * 1e-6:.0f} ms later than they did, by its own count of them; see what holds"
            " them up on their way, or other work on this computer"
        )

    def _persisting_ns(self, count: int, span: int, tick_ns: float, now_ns: int) -> int:
        step = (count - self._count + span // 2) % span - span // 2
        away_ns = now_ns - self._looked_ns
        self._count, self._looked_ns = self._count + step, now_ns
        way_ns = now_ns - self._count * tick_ns
        # A count that goes back is that of a device which has restarted.
        known = self._least_ns is not None and step > 0
        self._least_ns = min((self._least_ns or 0.0) + _DRIFT * away_ns, way_ns) if known else way_ns
        late_ns = way_ns - self._least_ns
        if late_ns <= self._most_ns:
            self._until_ns = None
            return 0
        if self._until_ns is None or away_ns > _LASTS_NS:
            self._until_ns = now_ns + max(_LASTS_NS, away_ns)
        return round(late_ns) if now_ns >= self._until_ns else 0
