"""What an arm tells its caller: where in its life it is, and what a cycle found."""

from __future__ import annotations

import enum
from dataclasses import dataclass

from palpate.drivers.cia402.object_dictionary import DriveState
from palpate.drivers.cia402.settings import Applied


class ArmState(enum.Enum):
    """Where in its life the arm is."""

    NEW = "new"
    CONFIGURED = "configured"
    ENABLED = "enabled"
    STOPPED = "stopped"
    FAULTED = "faulted"
    CLOSED = "closed"


@dataclass(frozen=True, slots=True)
class Measured:
    """What one cycle found.

    Attributes:
        position_rad: Joint angles; where a drive did not answer, its last ones.
        states: What each drive says of itself; None where its statusword fits no pattern.
        fresh: Which drives answered this SYNC.
        sync_ns: When the SYNC went out and the drives sampled, monotonic.
        answered_ns: When the last answer came.
        sequence: Number of the SYNC.
        applied: What became of the set-point; None if there was none.
    """

    position_rad: tuple[float, ...]
    states: tuple[DriveState | None, ...]
    fresh: tuple[bool, ...]
    sync_ns: int
    answered_ns: int
    sequence: int
    applied: Applied | None
