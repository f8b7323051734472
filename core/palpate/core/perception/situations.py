"""Task-specific features in addition to the nine channels, and the situations for a peg with corners."""

from dataclasses import dataclass
from typing import ClassVar, Final

from palpate.core.perception.signal import require_finite
from palpate.core.ports import CHANNELS, Names, Settings

FACTS: Final = ("tilt", "corner_depth", "depth", "wall_force", "yaw_torque")
"""Values, each a fraction of its threshold: tool tilt over a corner; depth of the lowest corner in the hole;
depth of an upright tool in the hole, or of a tilted one whose corner is in its place; the smaller force on the corner's
two walls; the torque about the tool's axis that turns it."""


@dataclass(frozen=True)
class TaskFacts(Settings):
    """Feature extractor that returns, unchanged, the values that the task appends to the channels.

    Attributes:
        facts: Value names, in the task's order.
    """

    TABLE: ClassVar[str] = "perception.extractor"

    facts: Names

    @property
    def names(self) -> tuple[str, ...]:
        """Return the value names."""
        return self.facts

    def extract(self, signal: tuple[float, ...]) -> tuple[float, ...]:
        """Return the values in their own units, or zeros if the task appended none."""
        facts = signal[len(CHANNELS) :]
        return facts if facts else (0.0,) * len(self.facts)


@dataclass(frozen=True)
class Situations(Settings):
    """Eight situations for a peg with corners, derived from :data:`FACTS`.

    Attributes:
        tilted: Tilt below which a tool counts as upright.
        air: Height above the plate beyond which a corner is in the air.
        plate: Depth beyond which a tilted corner is in the hole, not on the plate.
        upright: Depth beyond which an upright tool is in the hole, not on the plate.
        seated: Tip depth beyond which a tilted tool is seated rather than held only by the walls.
        wall: Force above which a wall carries load.
        quiet: Torque below which the tool does not turn.
    """

    TABLE: ClassVar[str] = "perception.symboliser"

    tilted: float = 0.2
    air: float = 0.5
    plate: float = 1.0
    upright: float = 1.0
    seated: float = 1.0
    wall: float = 1.0
    quiet: float = 1.0
    symbols: ClassVar[tuple[str, ...]] = (
        "upright in the air", "upright on the plate", "upright in the hole",
        "tilted in the air", "tilted on the plate", "corner turning", "corner wedged", "corner seated",
    )  # fmt: skip

    @property
    def features(self) -> tuple[str, ...]:
        """Return the required value names."""
        return FACTS

    def symbol(self, features: tuple[float, ...]) -> int:
        """Return the situation's index."""
        require_finite("features", features)
        tilt, corner, tip, wall, torque = features
        if tilt < self.tilted:
            return 0 if tip < -self.air else 1 if tip < self.upright else 2
        if corner < self.plate:
            return 3 if corner < -self.air else 4
        if wall <= self.wall or abs(torque) >= self.quiet:
            return 5
        return 6 if tip < self.seated else 7
