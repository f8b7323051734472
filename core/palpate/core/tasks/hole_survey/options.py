"""What only a survey of holes has."""

from dataclasses import dataclass
from typing import Annotated, ClassVar, Final

from typing_extensions import override

from palpate.core.errors import ConfigurationError
from palpate.core.ports import Range, Settings

_WHOLE: Final = ("plate_touches", "floor_touches", "wall_touches")


@dataclass(frozen=True)
class SurveyOptions(Settings):
    """Where is touched, how often and how hard; all that concerns the hole's size is as a drawing has it, roughly."""

    TABLE: ClassVar[str] = "task.options"

    probe_mm: Annotated[float, Range(0.5, 100.0)] = 6.0
    """Diameter of the round probe."""
    aside_mm: Annotated[float, Range(1.0, 200.0)] = 13.0
    """How far beside a place the plate's height is touched: there has to be plate under all of the probe."""
    plate_touches: Annotated[float, Range(2.0, 24.0)] = 3.0
    """Touches of the plate round a hole, evenly."""
    floor_touches: Annotated[float, Range(2.0, 24.0)] = 3.0
    """Touches of the hole's floor."""
    wall_touches: Annotated[float, Range(4.0, 72.0)] = 8.0
    """Touches of its wall, evenly all round, after four that find its middle."""
    search_mm: Annotated[float, Range(0.1, 50.0)] = 6.0
    """How far from its place a hole is looked for."""
    pitch_mm: Annotated[float, Range(0.05, 20.0)] = 2.0
    """From turn to turn of the spiral in which it is looked for; less than the hole is wider than the probe."""
    widest_mm: Annotated[float, Range(0.5, 200.0)] = 12.0
    """Diameter of the widest hole: farther out no wall is looked for."""
    deepest_mm: Annotated[float, Range(2.0, 100.0)] = 20.0
    """Depth down to which a floor is looked for."""
    wall_depth_mm: Annotated[float, Range(0.5, 50.0)] = 4.0
    """Depth at which the wall is touched; at most half way down to the floor."""
    push_N: Annotated[float, Range(1.0, 50.0)] = 4.0
    """Force with which the wall is touched."""
    tool_kg: Annotated[float, Range(0.0, 20.0)] = 0.35
    """Mass of all that the force sensor carries, which a heave in air shows."""
    unanswered_N: Annotated[float, Range(0.0, 40.0)] = 25.0
    """Where something may be met the probe heaves by drawn strokes, and goes no further from where the force answered
    them than bends the gripper by this; 0: it heaves evenly, and a force that follows at any lag counts."""
    tolerance_mm: Annotated[float, Range(0.001, 10.0)] = 0.05
    """A survey with a larger uncertainty, or with a larger true error where that is known, is no success."""

    @override
    def check(self) -> None:
        for name in _WHOLE:
            if not getattr(self, name).is_integer():
                raise ConfigurationError(self.dotted(name), getattr(self, name), "a whole number")
        if self.unanswered_N and not self.tool_kg:
            accepted = "0 with tool_kg = 0: what a heave gives in air is told by the tool's mass"
            raise ConfigurationError(self.dotted("unanswered_N"), self.unanswered_N, accepted)
        if self.widest_mm <= self.probe_mm:
            raise ConfigurationError(
                self.dotted("widest_mm"), self.widest_mm, f"more than probe_mm = {self.probe_mm:g}"
            )
