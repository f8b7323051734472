"""What the bus has been through: exchanges, errors, times."""

from collections import Counter, deque
from dataclasses import dataclass, field, replace
from typing import Final

from palpate.drivers.nmc.replies import Discarded

_KEPT: Final = 8192
"""Round trips that are remembered: ten seconds of six axes at 140 Hz."""


@dataclass(slots=True)
class BusStatistics:
    """Counters; only the bus writes them, and others get copies.

    Attributes:
        wire_s: Time that the bytes of all exchanges take on the wire, by calculation.
        waiting_s: Time spent inside the stream's read and write.
        total_s: That, and our own work.
        round_trips_ns: From the first byte sent to the last received, of the newest accepted replies.
    """

    exchanges: int = 0
    discarded: Counter[Discarded] = field(default_factory=Counter)
    stray_bytes: int = 0
    resyncs: int = 0
    wire_s: float = 0.0
    waiting_s: float = 0.0
    total_s: float = 0.0
    round_trips_ns: deque[int] = field(default_factory=lambda: deque(maxlen=_KEPT))

    @property
    def own_s(self) -> float:
        """Time of our own work."""
        return max(0.0, self.total_s - self.waiting_s)

    @property
    def errors(self) -> int:
        """Replies thrown away, whatever the reason."""
        return self.discarded.total()

    def copy(self) -> "BusStatistics":
        """The counters as they are now."""
        return replace(self, discarded=self.discarded.copy(), round_trips_ns=self.round_trips_ns.copy())
