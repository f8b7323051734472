"""What the loop asks of the operating system, and how late it may be."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from palpate.core.errors import ConfigurationError, require_in, require_one_of, require_whole

AS_IS: Final = "as is"
FROZEN: Final = "frozen"
OFF: Final = "off"
_LONGEST_MS: Final = 60_000.0
_MOST_CPUS: Final = 4096


@dataclass(frozen=True, slots=True)
class RealTimeConfig:
    """Real-time behaviour of the control loop. What the system refuses is told, and the run goes on without it."""

    scheduling: bool = False
    """Ask for the real-time scheduling class (SCHED_FIFO) while a trial runs."""
    priority: int = 50
    """Priority in it, 1 to 99."""
    lock_memory: bool = False
    """Keep the memory of the process from being paged out."""
    cpu: int = -1
    """Keep the loop on this CPU while a trial runs; -1 leaves it to the system."""
    garbage_collection: str = AS_IS
    """as is; frozen: what is there at the start is never looked at again; off: only between trials."""
    stay_awake: bool = False
    """Keep idle processors from sleeping while the run lasts: they wake sooner, and need more power."""
    warm_up_ticks: int = 70
    """Ticks at the start of a run whose times do not count: caches fill and code runs for the first time."""
    warn_late_ms: float = 3.5
    """Warn of a tick that begins later than this after its time; 0 never."""
    stop_late_ms: float = 0.0
    """Stop the arm and end the run at a tick that begins later than this after its time; 0 never."""
    warn_core_ms: float = 3.5
    """Warn of a tick in which the core thought for longer than this; 0 never."""

    def __post_init__(self) -> None:
        name = "real_time."
        require_whole(name + "priority", self.priority, 1, 99)
        require_whole(name + "cpu", self.cpu, -1, _MOST_CPUS)
        require_one_of(name + "garbage_collection", self.garbage_collection, (AS_IS, FROZEN, OFF))
        require_whole(name + "warm_up_ticks", self.warm_up_ticks, 0, 1_000_000)
        for field in ("warn_late_ms", "stop_late_ms", "warn_core_ms"):
            require_in(name + field, getattr(self, field), 0.0, _LONGEST_MS)
        if self.stop_late_ms and self.warn_late_ms > self.stop_late_ms:
            accepted = f"at most stop_late_ms, which is {self.stop_late_ms:g}"
            raise ConfigurationError(name + "warn_late_ms", self.warn_late_ms, accepted)
