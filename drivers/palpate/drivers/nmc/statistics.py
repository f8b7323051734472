"""What the bus has been through: exchanges, errors, times."""

from collections import Counter, deque
from dataclasses import dataclass, field
from typing import Final

from palpate.drivers.nmc.replies import Discarded

_KEPT: Final = 8192
"""Round trips that are remembered: ten seconds of six axes at 140 Hz."""


@dataclass(frozen=True, slots=True)
class BusStatistics:
    """A copy of the counters.

    Attributes:
        round_trips_ns: From the first byte sent to the last received, of the newest accepted replies.
        wire_s: Time that the bytes of all exchanges take on the wire, by calculation.
        waiting_s: Time spent inside the stream's read and write.
    """

    exchanges: int
    discarded: dict[Discarded, int]
    stray_bytes: int
    resyncs: int
    round_trips_ns: tuple[int, ...]
    wire_s: float
    waiting_s: float
    own_s: float

    @property
    def errors(self) -> int:
        """Replies thrown away, whatever the reason."""
        return sum(self.discarded.values())


@dataclass(slots=True)
class Counters:
    """The counters themselves; only the bus writes them. Units as in :class:`BusStatistics`, but ns."""

    exchanges: int = 0
    discarded: Counter[Discarded] = field(default_factory=Counter)
    stray_bytes: int = 0
    resyncs: int = 0
    wire_ns: float = 0.0
    waiting_ns: int = 0
    total_ns: int = 0
    round_trips_ns: deque[int] = field(default_factory=lambda: deque(maxlen=_KEPT))

    def copy(self) -> BusStatistics:
        """The counters as they are now."""
        return BusStatistics(
            exchanges=self.exchanges,
            discarded=dict(self.discarded),
            stray_bytes=self.stray_bytes,
            resyncs=self.resyncs,
            round_trips_ns=tuple(self.round_trips_ns),
            wire_s=self.wire_ns * 1e-9,
            waiting_s=self.waiting_ns * 1e-9,
            own_s=max(0, self.total_ns - self.waiting_ns) * 1e-9,
        )
