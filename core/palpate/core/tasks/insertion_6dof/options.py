"""Options for the insertion in six degrees of freedom."""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, pi, radians, sin
from typing import Annotated, ClassVar

from typing_extensions import override

from palpate.core.ports import Range, Settings


@dataclass(frozen=True)
class SpatialOptions(Settings):
    """The tool's shape, weight and compliance."""

    TABLE: ClassVar[str] = "task.options"

    corners: Annotated[float, Range(0.0, 12.0)] = 0.0
    """Number of corners, evenly spaced about the axis; the first is half a spacing from the task's x axis; 0 if there
    are none."""
    corner_mm: Annotated[float, Range(0.1, 100.0)] = 20.0
    """Distance from the peg's axis to the corners or the flat."""
    flat_deg: Annotated[float, Range(0.0, 80.0)] = 0.0
    """Half the angle that a keyed peg's flat, across the task's x, subtends at the axis; 0 if there is none."""
    tilt_deg: Annotated[float, Range(1.0, 15.0)] = 5.0
    """Tilt at which one corner goes down first."""
    down_share: Annotated[float, Range(0.1, 1.0)] = 0.9
    """Depth to which a tilted corner or flat is lowered in the hole, divided by its neighbours' or the tip's height."""
    inside_mm: Annotated[float, Range(0.5, 50.0)] = 6.5
    """Distance inside the nominal corner of the hole, along its diagonal, at which the peg's corner comes down."""
    push_N: Annotated[float, Range(0.5, 10.0)] = 3.0
    """Force on each of the corner's two walls."""
    push_m_per_N_s: Annotated[float, Range(1e-4, 3e-3)] = 2e-3
    """Lateral speed divided by the error in the push force."""
    push_yaw_rad_per_Nms: Annotated[float, Range(0.0, 100.0)] = 4.0
    """Compliance about the tool axis during a push."""
    drive_Nm: Annotated[float, Range(0.0, 5.0)] = 0.05
    """Torque about the tool axis that turns a wedged corner against friction."""
    insert_yaw_rad_per_Nms: Annotated[float, Range(0.0, 1.0)] = 0.2
    """Compliance about the tool axis in the hole."""
    insert_tilt_rad_per_Nms: Annotated[float, Range(0.0, 1.0)] = 0.4
    """Tilt compliance in the hole."""
    wobble_deg_s: Annotated[float, Range(0.5, 8.0)] = 4.0
    """Wobble speed (two circles in tilt per second) for a tool stuck in the hole or possibly on its floor. A
    wedged peg then goes in further."""
    tool_kg: Annotated[float, Range(0.0, 20.0)] = 0.35
    """Mass of everything on the force sensor, used to compensate its weight when the tool tilts."""
    tool_above_tip_mm: Annotated[float, Range(0.0, 2000.0)] = 63.0
    """Height of the tool's centre of mass above the tip."""
    most_tilt_deg: Annotated[float, Range(1.0, 30.0)] = 8.0
    """Maximum tool tilt."""
    most_yaw_deg: Annotated[float, Range(1.0, 45.0)] = 20.0
    """Maximum tool rotation about its axis."""

    @property
    def neighbour_height(self) -> float:
        """Return the height of a tilted corner's neighbours above it, divided by the tip's height; at most 1."""
        return min(1.0 - cos(2.0 * pi / self.corners), 1.0) if self.corners else 1.0

    @property
    def down_m(self) -> float:
        """Return a tilted corner's depth in the hole, with its neighbours above the plate."""
        return self.down_share * self.neighbour_height * self.corner_mm * 1e-3 * sin(radians(self.tilt_deg))

    @override
    def check(self) -> None:
        self.require("flat_deg", not self.corners or not self.flat_deg, "0 for a peg with corners")
        most = f"at most most_tilt_deg = {self.most_tilt_deg:g}"
        self.require("tilt_deg", self.tilt_deg <= self.most_tilt_deg, most)
