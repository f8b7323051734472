"""What a task adds to the nine channels, and the situations of a peg with corners that are told apart by it."""

from dataclasses import dataclass
from typing import ClassVar, Final

from palpate.core.perception.signal import require_finite
from palpate.core.ports import CHANNELS, Names, Settings

FACTS: Final = ("lean", "corner_depth", "depth", "wall_force", "yaw_torque")
"""As shares of what counts: lean of the tool over a corner; depth of the lowest corner in the hole; depth of an
upright tool in the hole, or of a leaning one whose corner is in its place; the lesser force of the corner's two walls;
the torque about the tool's axis that turns it."""


@dataclass(frozen=True)
class TaskFacts(Settings):
    """The features are what the task adds behind the channels, unchanged.

    Attributes:
        facts: Their names, in the order in which the task gives them.
    """

    TABLE: ClassVar[str] = "perception.extractor"

    facts: Names

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the features: those of the facts."""
        return self.facts

    def extract(self, signal: tuple[float, ...]) -> tuple[float, ...]:
        """The facts, in their own units; zeros where the task gave none."""
        facts = signal[len(CHANNELS) :]
        return facts if facts else (0.0,) * len(self.facts)


@dataclass(frozen=True)
class Situations(Settings):
    """Eight situations of a peg with corners, of :data:`FACTS`.

    Attributes:
        leaning: A tool that leans by less stands upright.
        air: A corner that is so far above the plate is in the air.
        plate: A leaning corner that is no deeper stands on the plate.
        upright: An upright tool that is no deeper stands on the plate.
        caught: A leaning tool whose tip is less deep is held by its walls alone.
        wall: A wall carries from this force on.
        quiet: Less torque does not turn the tool.
    """

    TABLE: ClassVar[str] = "perception.symboliser"

    leaning: float = 0.2
    air: float = 0.5
    plate: float = 1.0
    upright: float = 1.0
    caught: float = 1.0
    wall: float = 1.0
    quiet: float = 1.0
    symbols: ClassVar[tuple[str, ...]] = (
        "upright in the air", "upright on the plate", "upright in the hole",
        "leaning in the air", "leaning on the plate", "corner turning", "corner wedged", "corner caught",
    )  # fmt: skip

    @property
    def features(self) -> tuple[str, ...]:
        """The facts that it looks at."""
        return FACTS

    def symbol(self, features: tuple[float, ...]) -> int:
        """The situation."""
        require_finite("features", features)
        lean, corner, tip, wall, torque = features
        if lean < self.leaning:
            return 0 if tip < -self.air else 1 if tip < self.upright else 2
        if corner < self.plate:
            return 3 if corner < -self.air else 4
        if wall <= self.wall or abs(torque) >= self.quiet:
            return 5
        return 6 if tip < self.caught else 7
