"""How the bus has been doing: figures for ``palpate doctor``."""

from __future__ import annotations

from array import array
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from palpate.drivers.cia402.mailbox import Emergency, NodeBox

_KEPT: Final = 8192


@dataclass(frozen=True, slots=True)
class NodeStatistics:
    """Figures of one drive since the bus was opened.

    Attributes:
        node: Its number.
        missed: SYNCs that it did not answer in time.
        late: Answers that came after their deadline and before the next SYNC. Later ones cannot be told from
            answers to the next SYNC, because process data carry no number.
        duplicates: Answers beyond the first to one SYNC.
        malformed: Frames of a wrong length.
        longest_heartbeat_gap_s: Longest time between two heartbeats.
        emergencies: EMCY messages that report an error.
    """

    node: int
    missed: int
    late: int
    duplicates: int
    malformed: int
    longest_heartbeat_gap_s: float
    emergencies: int


@dataclass(frozen=True, slots=True)
class ArmStatistics:
    """Figures of the arm.

    Attributes:
        cycles: SYNCs sent.
        round_trip_min_s: Shortest time from the first frame of a cycle to the last answer.
        round_trip_median_s: Its median, over the newest cycles that were answered in full.
        round_trip_p99_s: Its 99th percentile.
        round_trip_max_s: Its longest.
        nodes: One record a drive.
        emergencies: The newest EMCY messages, oldest first.
    """

    cycles: int
    round_trip_min_s: float
    round_trip_median_s: float
    round_trip_p99_s: float
    round_trip_max_s: float
    nodes: tuple[NodeStatistics, ...]
    emergencies: tuple[Emergency, ...]


class Tally:
    """Counts while the cycle runs; it allocates nothing then.

    Args:
        drives: Number of drives.
    """

    def __init__(self, drives: int) -> None:
        self.cycles = 0
        self.missed = [0] * drives
        self._round_trips_ns = array("q", bytes(8 * _KEPT))
        self._complete = 0

    def add(self, round_trip_ns: int, fresh: Sequence[bool]) -> None:
        """Count one cycle."""
        self.cycles += 1
        if all(fresh):
            self._round_trips_ns[self._complete % _KEPT] = round_trip_ns
            self._complete += 1
        else:
            self.missed = [missed + (not answered) for missed, answered in zip(self.missed, fresh, strict=True)]

    def summary(self, boxes: Sequence[NodeBox], emergencies: tuple[Emergency, ...]) -> ArmStatistics:
        """All figures so far; round trips are 0 before the first full cycle."""
        times = sorted(self._round_trips_ns[: min(self._complete, _KEPT)]) or [0]
        low, middle, high, top = [
            times[min(len(times) - 1, int(share * len(times)))] * 1e-9 for share in (0.0, 0.5, 0.99, 1.0)
        ]
        nodes = tuple(
            NodeStatistics(
                node=box.node,
                missed=missed,
                late=box.late,
                duplicates=box.duplicates,
                malformed=box.malformed,
                longest_heartbeat_gap_s=box.longest_gap_ns * 1e-9,
                emergencies=box.emergencies,
            )
            for box, missed in zip(boxes, self.missed, strict=True)
        )
        return ArmStatistics(self.cycles, low, middle, high, top, nodes, emergencies)
