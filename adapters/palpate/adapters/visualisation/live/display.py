"""What a viewer is shown, whichever it is."""

from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Final, Protocol, TypeAlias

from palpate.adapters.experiments import WINDOW, moving_average
from palpate.adapters.log import DecisionEntry

Row: TypeAlias = tuple[float, ...]

SERIES: Final[dict[str, tuple[str, ...]]] = {
    "wrench": ("fx_N", "fy_N", "fz_N", "tx_Nm", "ty_Nm", "tz_Nm"),
    "tip": ("x_mm", "y_mm", "z_mm"),
    "timing": ("late_ms", "wrench_age_ms"),
    "command": ("altered_mrad",),
}
"""Numbers over time, and what each is: the wrench less its zero, in the sensor's frame; the tip in the task frame; how
late a tick began and how old its wrench was; and by how much the arm's answer differs from what it was told."""

MOST_TRIALS: Final = 1000
"""Trials of a learning curve that are shown: the newest."""

BASE: Final = "base"
"""Name of the frame that the others are given in."""


@dataclass(frozen=True)
class Shape:
    """A body that is drawn.

    Attributes:
        kind: ``box``, ``cylinder``, ``capsule``, ``sphere`` or ``mesh``.
        half_m: Half its lengths along its own axes, (3,); of a capsule, those of the cylinder between its ends.
        position_m: Its middle, (3,), in the frame it belongs to.
        quaternion: Its orientation there, (w, x, y, z).
        rgba: Its colour, 0 to 1.
        triangles_m: Corners of a mesh, three of each triangle, (n, 3), in the frame it belongs to.
    """

    kind: str
    half_m: Row
    position_m: Row
    quaternion: Row
    rgba: Row
    triangles_m: tuple[Row, ...] = ()


@dataclass(frozen=True)
class Pose:
    """A frame in the base's: position (3,) in m, and quaternion (w, x, y, z)."""

    position_m: Row
    quaternion: Row


@dataclass
class LearningSoFar:
    """What came of trial after trial.

    Attributes:
        successes: 1 for a success, 0 for none.
    """

    label: str = ""
    trials: list[int] = field(default_factory=list)
    times_s: list[float] = field(default_factory=list)
    successes: list[float] = field(default_factory=list)
    peaks_N: list[float] = field(default_factory=list)

    @property
    def averages_s(self) -> list[float | None]:
        """Their moving average, where there are as many as it goes over."""
        means = moving_average(self.times_s)
        return [mean if number >= WINDOW else None for number, mean in enumerate(means, 1)]

    def add(self, trial: int, time_s: float, success: bool, peak_N: float) -> None:
        """One more trial is over."""
        self.trials.append(trial)
        self.times_s.append(time_s)
        self.successes.append(float(success))
        self.peaks_N.append(peak_N)


class Display(Protocol):
    """A viewer, or a file for one. Times are those of the run's clock, ns."""

    @abstractmethod
    def scene(self, time_ns: int, bodies: dict[str, list[Shape]]) -> None:
        """The shapes that belong to each frame; those of before are gone."""

    @abstractmethod
    def pose(self, time_ns: int, frames: dict[str, Pose], force: tuple[Row, Row] | None) -> None:
        """Where the frames are; and the force on the tool as an arrow, from a point (3,) by a vector (3,), base, m."""

    @abstractmethod
    def series(self, topic: str, times_ns: Sequence[int], rows: Sequence[Row]) -> None:
        """Numbers of :data:`SERIES`, a row for each time."""

    @abstractmethod
    def decision(self, time_ns: int, entry: DecisionEntry, values: dict[str, float]) -> None:
        """An action is chosen; and what each action was worth in that state as the trial began, where that is known."""

    @abstractmethod
    def supervisor(self, time_ns: int, state: str, detail: str) -> None:
        """What the supervisor does from now on."""

    @abstractmethod
    def event(self, time_ns: int, text: str, *, serious: bool = False) -> None:
        """Something happened."""

    @abstractmethod
    def learned(self, time_ns: int, curve: LearningSoFar) -> None:
        """One more trial is over; the curve is whole."""

    @abstractmethod
    def renew(self) -> None:
        """Show again what somebody who has just come would lack; does nothing where nobody does."""

    @abstractmethod
    def close(self) -> None:
        """Nothing more is shown."""
