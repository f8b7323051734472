"""A display that keeps what it is shown."""

from collections.abc import Sequence

from typing_extensions import override

from palpate.adapters.log import DecisionEntry
from palpate.adapters.visualisation.live.display import Display, LearningSoFar, Pose, Row, Shape


class KeptDisplay(Display):
    def __init__(self) -> None:
        self.scenes: list[dict[str, list[Shape]]] = []
        self.poses: list[tuple[int, dict[str, Pose], tuple[Row, Row] | None]] = []
        self.rows: dict[str, list[tuple[int, Row]]] = {}
        self.decisions: list[tuple[DecisionEntry, dict[str, float]]] = []
        self.states: list[str] = []
        self.events: list[tuple[str, bool]] = []
        self.curve = LearningSoFar()
        self.renewals = 0

    @override
    def scene(self, time_ns: int, bodies: dict[str, list[Shape]]) -> None:
        self.scenes.append(bodies)

    @override
    def pose(self, time_ns: int, frames: dict[str, Pose], force: tuple[Row, Row] | None) -> None:
        self.poses.append((time_ns, frames, force))

    @override
    def series(self, topic: str, times_ns: Sequence[int], rows: Sequence[Row]) -> None:
        self.rows.setdefault(topic, []).extend(zip(times_ns, rows, strict=True))

    @override
    def decision(self, time_ns: int, entry: DecisionEntry, values: dict[str, float]) -> None:
        self.decisions.append((entry, values))

    @override
    def supervisor(self, time_ns: int, state: str, detail: str) -> None:
        self.states.append(state)

    @override
    def event(self, time_ns: int, text: str, *, serious: bool = False) -> None:
        self.events.append((text, serious))

    @override
    def learned(self, time_ns: int, curve: LearningSoFar) -> None:
        self.curve = curve

    @override
    def renew(self) -> None:
        self.renewals += 1

    @override
    def close(self) -> None: ...
