"""What the bus has been through: exchanges and errors."""

from collections import Counter
from dataclasses import dataclass, field, replace

from palpate.drivers.nmc.replies import Discarded


@dataclass(slots=True)
class BusStatistics:
    """Counters; only the bus writes them, and others get copies."""

    exchanges: int = 0
    discarded: Counter[Discarded] = field(default_factory=Counter)
    stray_bytes: int = 0
    resyncs: int = 0

    @property
    def errors(self) -> int:
        """Replies thrown away, whatever the reason."""
        return self.discarded.total()

    def copy(self) -> "BusStatistics":
        """The counters as they are now."""
        return replace(self, discarded=self.discarded.copy())
