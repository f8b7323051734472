"""Outlines of pegs and holes: a circle or a regular polygon, from one description.

Everything is in the plane across the tool axis. An outline is given by the radius of its inscribed circle (its
apothem), so that a hole is the same outline with the clearance added to the apothem, and the gap is the
clearance on every side.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, pi, sin, tan
from typing import Final

SIDES: Final = {"triangle": 3, "square": 4, "hexagon": 6}


@dataclass(frozen=True, slots=True)
class Wall:
    """One flat piece of a hole's wall.

    Attributes:
        heading_rad: Direction of its outward normal, seen from the hole's axis.
        distance_m: Distance of its face from the axis.
        half_width_m: Half its width along the face.
    """

    heading_rad: float
    distance_m: float
    half_width_m: float


@dataclass(frozen=True, slots=True)
class CrossSection:
    """A round or polygonal outline.

    Attributes:
        sides: Number of sides; 0 for a circle.
        apothem_m: Radius of the inscribed circle.
    """

    sides: int
    apothem_m: float

    @classmethod
    def named(cls, name: str, apothem_m: float) -> CrossSection:
        """The outline called round, triangle, square or hexagon."""
        return cls(SIDES.get(name, 0), apothem_m)

    def walls(self, boxes: int, reach_m: float) -> list[Wall]:
        """Walls of a hole with this outline.

        A box whose inner face touches the inscribed circle never enters it, however wide it is. So the walls are
        made wide enough to leave no gaps between them up to ``reach_m`` outside the hole.

        Args:
            boxes: Number of walls for a circle; a polygon has one per side.
            reach_m: How far from the outline the plate's surface must be closed.
        """
        count = self.sides or boxes
        width = (self.apothem_m + reach_m) * tan(pi / count) * 1.02
        return [Wall(2 * pi * k / count, self.apothem_m, width) for k in range(count)]

    def rim(self, count: int, inset_m: float) -> list[tuple[float, float]]:
        """Centres of small spheres along the outline, evenly spaced, ``inset_m`` inside it; corners included."""
        apothem = self.apothem_m - inset_m
        if not self.sides:
            angles = [2 * pi * k / count for k in range(count)]
            return [(apothem * cos(a), apothem * sin(a)) for a in angles]
        # A side's normal points at heading 2 pi k / n, as a wall's does; corners lie half way between.
        corner = apothem / cos(pi / self.sides)
        corners = [
            (corner * cos(2 * pi * (k + 0.5) / self.sides), corner * sin(2 * pi * (k + 0.5) / self.sides))
            for k in range(self.sides)
        ]
        per_side = -(-count // self.sides)
        points = []
        for (ax, ay), (bx, by) in zip(corners, corners[1:] + corners[:1], strict=True):
            points += [(ax + (bx - ax) * i / per_side, ay + (by - ay) * i / per_side) for i in range(per_side)]
        return points
