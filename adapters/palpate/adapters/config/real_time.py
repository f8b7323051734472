"""What the loop requests from the operating system."""

from dataclasses import dataclass
from typing import Annotated, ClassVar

from palpate.core.ports import Range, Settings


@dataclass(frozen=True)
class RealTimeConfig(Settings):
    """Real-time behaviour of the control loop. A refusal by the system is printed, and the run continues without."""

    TABLE: ClassVar[str] = "real_time"

    scheduling: bool = False
    """Ask for the real-time scheduling class (SCHED_FIFO) while a trial runs."""
    priority: Annotated[int, Range(1, 99)] = 50
    """Priority in it, 1 to 99."""
    lock_memory: bool = False
    """Keep the memory of the process from being paged out."""
    cpu: Annotated[int, Range(-1, 4096)] = -1
    """Keep the loop on this CPU while a trial runs; -1 leaves it to the system."""
    freeze_objects: bool = False
    """Exempt the objects that exist at the start from garbage collection."""
