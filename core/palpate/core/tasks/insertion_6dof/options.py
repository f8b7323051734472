"""What only an insertion in six degrees of freedom is set up by."""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, pi, radians, sin
from typing import Annotated, ClassVar

from typing_extensions import override

from palpate.core.ports import Range, Settings


@dataclass(frozen=True)
class SpatialOptions(Settings):
    """Shape and weight of what is held, and how the tool gives way."""

    TABLE: ClassVar[str] = "task.options"

    corners: Annotated[float, Range(0.0, 12.0)] = 0.0
    """Corners of the peg, evenly about its axis, the first at half their angle from the task's x; 0 for none."""
    corner_mm: Annotated[float, Range(0.1, 100.0)] = 20.0
    """Distance of the corners, or of the flat, from the peg's axis."""
    flat_deg: Annotated[float, Range(0.0, 80.0)] = 0.0
    """Half the angle under which a keyed peg's flat, across the task's x, is seen from the axis; 0 for none."""
    lean_deg: Annotated[float, Range(1.0, 15.0)] = 5.0
    """How far the tool leans to bring one corner down first."""
    down_share: Annotated[float, Range(0.1, 1.0)] = 0.9
    """Until the tool stands, this share of what a leaning corner or flat lies below the tip is let into the hole."""
    inside_mm: Annotated[float, Range(0.5, 50.0)] = 6.5
    """So far inside the nominal corner of the hole, along its diagonal, the peg's corner comes down."""
    push_N: Annotated[float, Range(0.5, 10.0)] = 3.0
    """Force on each of the corner's two walls."""
    push_m_per_N_s: Annotated[float, Range(1e-4, 3e-3)] = 2e-3
    """Speed across over the error of that force."""
    give_yaw_rad_per_Nms: Annotated[float, Range(0.0, 100.0)] = 4.0
    """How the tool gives way about its axis while it pushes."""
    drive_Nm: Annotated[float, Range(0.0, 5.0)] = 0.05
    """Torque about its axis that turns a wedged corner against friction."""
    insert_yaw_rad_per_Nms: Annotated[float, Range(0.0, 1.0)] = 0.2
    """How it gives way about its axis in the hole."""
    insert_tilt_rad_per_Nms: Annotated[float, Range(0.0, 1.0)] = 0.4
    """How it gives way in tilt in the hole."""
    wobble_deg_s: Annotated[float, Range(0.5, 8.0)] = 4.0
    """A tool that sinks no further in the hole, or may stand on its floor, circles in tilt at this rate, twice a
    second: a wedge shows by sinking on."""
    tool_kg: Annotated[float, Range(0.0, 20.0)] = 0.35
    """Mass of all that the force sensor carries: its weight is taken off while the tool leans."""
    tool_above_tip_mm: Annotated[float, Range(0.0, 2000.0)] = 63.0
    """Height of its centre above the tip."""
    most_lean_deg: Annotated[float, Range(1.0, 30.0)] = 8.0
    """The tool may lean no further."""
    most_yaw_deg: Annotated[float, Range(1.0, 45.0)] = 20.0
    """The tool may turn no further about its axis."""

    @property
    def beside(self) -> float:
        """How far a leaning corner's neighbours lie above it, over the height of the tip; 1 at most."""
        return min(1.0 - cos(2.0 * pi / self.corners), 1.0) if self.corners else 1.0

    @property
    def down_m(self) -> float:
        """Depth of a leaning corner in the hole: its neighbours stay above the plate, where they turn freely."""
        return self.down_share * self.beside * self.corner_mm * 1e-3 * sin(radians(self.lean_deg))

    @override
    def check(self) -> None:
        self.require("flat_deg", not self.corners or not self.flat_deg, "0 for a peg with corners")
        most = f"at most most_lean_deg = {self.most_lean_deg:g}"
        self.require("lean_deg", self.lean_deg <= self.most_lean_deg, most)
