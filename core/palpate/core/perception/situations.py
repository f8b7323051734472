"""What a task adds to the nine channels, and the situations of a peg with corners that are told apart by it."""

from dataclasses import dataclass, fields
from typing import ClassVar, Final

from palpate.core.perception.signal import require_finite
from palpate.core.ports import CHANNELS, names, number

FACTS: Final = ("lean", "corner_depth", "depth", "wall_force", "yaw_torque")
"""Lean of the tool in rad, depth of its lowest corner and of its tip below the plate in m, the lesser force that the
corner's two walls give in N, the torque about the tool's axis in N m."""


@dataclass(frozen=True)
class TaskFacts:
    """The features are what the task adds behind the channels, unchanged.

    Attributes:
        facts: Their names, in the order in which the task gives them.
    """

    facts: tuple[str, ...]

    def __post_init__(self) -> None:
        object.__setattr__(self, "facts", names("perception.extractor.facts", self.facts))

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the features: those of the facts."""
        return self.facts

    def extract(self, signal: tuple[float, ...]) -> tuple[float, ...]:
        """The facts, in their own units; zeros where the task gave none."""
        facts = signal[len(CHANNELS) :]
        return facts if facts else (0.0,) * len(self.facts)


@dataclass(frozen=True)
class Situations:
    """Eight situations of a peg with corners, of :data:`FACTS`.

    Attributes:
        upright_rad: A tool that leans by less stands upright.
        air_m: A corner that is so far above the plate is in the air.
        plate_m: A leaning corner that is no deeper stands on the plate.
        upright_m: An upright tool that is no deeper stands on the plate.
        caught_m: A leaning tool whose tip is less deep is held by its walls alone.
        wall_N: A wall carries from this force on.
        quiet_Nm: Less torque does not turn the tool.
    """

    upright_rad: float = 0.017
    air_m: float = 0.3e-3
    plate_m: float = 0.6e-3
    upright_m: float = 0.25e-3
    caught_m: float = 0.5e-3
    wall_N: float = 1.5
    quiet_Nm: float = 0.012
    symbols: ClassVar[tuple[str, ...]] = (
        "upright in the air", "upright on the plate", "upright in the hole",
        "leaning in the air", "leaning on the plate", "corner turning", "corner wedged", "corner caught",
    )  # fmt: skip

    def __post_init__(self) -> None:
        for field in fields(self):
            number(f"perception.symboliser.{field.name}", getattr(self, field.name))

    @property
    def features(self) -> tuple[str, ...]:
        """The facts that it looks at."""
        return FACTS

    def symbol(self, features: tuple[float, ...]) -> int:
        """The situation."""
        require_finite("features", features)
        lean, corner_m, tip_m, wall_N, torque_Nm = features
        if lean < self.upright_rad:
            return 0 if tip_m < -self.air_m else 1 if tip_m < self.upright_m else 2
        if corner_m < self.plate_m:
            return 3 if corner_m < -self.air_m else 4
        if wall_N <= self.wall_N or abs(torque_Nm) >= self.quiet_Nm:
            return 5
        return 6 if tip_m < self.caught_m else 7
