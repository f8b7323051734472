"""What the loop asks of the operating system, and how late it may be."""

from dataclasses import dataclass
from typing import Annotated, ClassVar, Final

from typing_extensions import override

from palpate.core.errors import ConfigurationError
from palpate.core.ports import OneOf, Range, Settings

AS_IS: Final = "as is"
FROZEN: Final = "frozen"
OFF: Final = "off"
_LONGEST_MS: Final = 60_000.0


@dataclass(frozen=True)
class RealTimeConfig(Settings):
    """Real-time behaviour of the control loop. What the system refuses is told, and the run goes on without it."""

    TABLE: ClassVar[str] = "real_time"

    scheduling: bool = False
    """Ask for the real-time scheduling class (SCHED_FIFO) while a trial runs."""
    priority: Annotated[int, Range(1, 99)] = 50
    """Priority in it, 1 to 99."""
    lock_memory: bool = False
    """Keep the memory of the process from being paged out."""
    cpu: Annotated[int, Range(-1, 4096)] = -1
    """Keep the loop on this CPU while a trial runs; -1 leaves it to the system."""
    garbage_collection: Annotated[str, OneOf(AS_IS, FROZEN, OFF)] = AS_IS
    """as is; frozen: what is there at the start is never looked at again; off: only between trials."""
    stay_awake: bool = False
    """Keep idle processors from sleeping while the run lasts: they wake sooner, and need more power."""
    warm_up_ticks: Annotated[int, Range(0, 1_000_000)] = 70
    """Ticks at the start of a run whose times do not count: caches fill and code runs for the first time."""
    warn_late_ms: Annotated[float, Range(0.0, _LONGEST_MS)] = 3.5
    """Warn of a tick that begins later than this after its time; 0 never."""
    stop_late_ms: Annotated[float, Range(0.0, _LONGEST_MS)] = 0.0
    """Stop the arm and end the run at a tick that begins later than this after its time; 0 never."""
    warn_core_ms: Annotated[float, Range(0.0, _LONGEST_MS)] = 3.5
    """Warn of a tick in which the core thought for longer than this; 0 never."""

    @override
    def check(self) -> None:
        if self.stop_late_ms and self.warn_late_ms > self.stop_late_ms:
            accepted = f"at most stop_late_ms, which is {self.stop_late_ms:g}"
            raise ConfigurationError(self.dotted("warn_late_ms"), self.warn_late_ms, accepted)
