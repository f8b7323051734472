"""Outlines of pegs and holes: a circle, a regular polygon with sharp or rounded corners, or a circle with a flat.

Outlines are convex and lie in the plane perpendicular to the tool axis. They are given by the radius of the inscribed
circle (the apothem), so a hole has the same outline, enlarged by the clearance on every side.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import acos, ceil, cos, pi, sin, tan


@dataclass(frozen=True, slots=True)
class Wall:
    """A flat piece of a hole's wall.

    Attributes:
        heading_rad: Direction of its outward normal, seen from the hole's axis.
        distance_m: Distance of its face from the axis.
        half_width_m: Half of its width along the face.
    """

    heading_rad: float
    distance_m: float
    half_width_m: float


@dataclass(frozen=True, slots=True)
class CrossSection:
    """A convex outline. Side 0, or the flat, has its normal along x.

    Attributes:
        sides: Number of sides, or 0 for a circle.
        apothem_m: Radius of the inscribed circle.
        corner_m: Corner radius of a polygon.
        flat_m: Distance of a circle's flat from its centre, or None without a flat.
    """

    sides: int
    apothem_m: float
    corner_m: float = 0.0
    flat_m: float | None = None

    def grown(self, by_m: float) -> CrossSection:
        """Return the outline moved outwards by this distance; sharp corners stay sharp."""
        corner_m = max(self.corner_m + by_m, 0.0) if self.corner_m else 0.0
        flat_m = None if self.flat_m is None else self.flat_m + by_m
        return replace(self, apothem_m=self.apothem_m + by_m, corner_m=corner_m, flat_m=flat_m)

    @property
    def is_polygon(self) -> bool:
        """Return True if the outline has only straight sides and sharp corners."""
        return bool(self.sides) and not self.corner_m

    def facets(self, most: int) -> int:
        """Return the number of walls of a hole with this outline, evenly spaced by heading.

        Args:
            most: Number for a circle. A polygon has one per side; with round corners, the same number on each side.
        """
        if not self.sides:
            return most
        return self.sides * (ceil(most / self.sides) if self.corner_m else 1)

    def walls(self, boxes: int, reach_m: float) -> list[Wall]:
        """Return the walls of a hole with this outline.

        A box whose inner face touches a convex outline never enters it, even if the box is wide. The walls are
        therefore wide enough to leave no gaps within ``reach_m`` of the hole.

        Args:
            boxes: Number of walls for a circle; see :meth:`facets`.
            reach_m: Distance from the outline within which the plate's surface must be closed.
        """
        count = self.facets(boxes)
        distances_m = [self._support_m(k, count) for k in range(count)]
        walls = []
        for k, distance_m in enumerate(distances_m):
            farther_m = max(distances_m[k - 1], distances_m[(k + 1) % count]) - distance_m
            width_m = (distance_m + reach_m) * tan(pi / count) + max(farther_m, 0.0) / sin(2 * pi / count)
            walls.append(Wall(2 * pi * k / count, distance_m, width_m * 1.02))
        return walls

    def _support_m(self, k: int, count: int) -> float:
        """Return the extent of the outline in the direction of wall k of ``count``."""
        if self.sides:
            # Headings are measured from the normal of the nearest side, so that sides are exact.
            each = count // self.sides
            off, centre_m = 2 * pi * min(k % each, -k % each) / count, self.apothem_m - self.corner_m
            return centre_m * (cos(off) + tan(pi / self.sides) * sin(off)) + self.corner_m
        heading = 2 * pi * min(k, count - k) / count
        if self.flat_m is None or heading >= self._flat_rad:
            return self.apothem_m
        return self.apothem_m * cos(self._flat_rad - heading)

    @property
    def _flat_rad(self) -> float:
        """Return half the angle of a flat as seen from the centre."""
        return 0.0 if self.flat_m is None else acos(self.flat_m / self.apothem_m)

    def outline(self, points: int) -> list[tuple[float, float]]:
        """Return the corners of the outline in order; round parts have the point density of a circle with n points."""
        if self.sides:
            each = self.facets(points) // self.sides
            centre_m = (self.apothem_m - self.corner_m) / cos(pi / self.sides)
            return [
                _at(centre_m, 2 * pi * (side + 0.5) / self.sides, self.corner_m, 2 * pi * (side + arc) / self.sides)
                for side in range(self.sides)
                for arc in ([i / each for i in range(each + 1)] if self.corner_m else [0.5])
            ]
        half = self._flat_rad
        headings = [2 * pi * k / points for k in range(points)]
        round_part = [heading for heading in headings if half < heading < 2 * pi - half or not half]
        return [_at(self.apothem_m, a) for a in ([half, *round_part, -half] if half else round_part)]

    def rim(self, count: int, inset_m: float) -> list[tuple[float, float]]:
        """Return the centres of evenly spaced spheres along the outline, ``inset_m`` inside it, including corners."""
        inner = self.grown(-inset_m)
        if not self.sides:
            return inner.outline(count)
        corners, per_side = inner.outline(1), -(-count // self.sides)
        points = []
        for (ax, ay), (bx, by) in zip(corners, corners[1:] + corners[:1], strict=True):
            points += [(ax + (bx - ax) * i / per_side, ay + (by - ay) * i / per_side) for i in range(per_side)]
        return points


def _at(radius_m: float, heading_rad: float, then_m: float = 0.0, towards_rad: float = 0.0) -> tuple[float, float]:
    """Return the point at a radius and heading from the centre, then shifted in another direction."""
    x, y = radius_m * cos(heading_rad), radius_m * sin(heading_rad)
    return x + then_m * cos(towards_rad), y + then_m * sin(towards_rad)
