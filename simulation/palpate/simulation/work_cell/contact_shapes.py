"""Contact geometry: rings of small spheres on the peg, and boxes that form the plate with its hole.

All coordinates are in the plate's frame, z into the hole and the surface at 0, with the peg upright on the hole's axis.
"""

from dataclasses import dataclass
from math import cos, hypot, pi
from typing import Final

from palpate.simulation.work_cell.config import SURFACE_BEGINS_MM, PegConfig

UPPER_RING_M: Final = 0.008
"""Height of the peg's upper ring of spheres above its tip."""
_RIM_M: Final = SURFACE_BEGINS_MM * 1e-3


@dataclass(frozen=True, slots=True)
class Box:
    """One of the boxes that make up the plate.

    Attributes:
        distance_m: Distance of its centre from the hole's axis.
        depth_m: Depth of its centre below the surface.
        half_m: Half of its size along its own axes: away from the hole, along the wall, and downwards.
    """

    heading_rad: float
    distance_m: float
    depth_m: float
    half_m: tuple[float, float, float]


def plate_boxes(peg: PegConfig, reach_m: float) -> list[Box]:
    """Return the plate's boxes: the wall of the hole, the surface around it, and finally the floor of the hole.

    Args:
        peg: Shape and size of the hole.
        reach_m: Distance from the hole's edge to the edge of the closed surface.
    """
    hole = peg.section(peg.clearance_mm)
    depth = peg.hole_depth_mm * 1e-3
    half_thickness = (depth + 0.005) / 2
    # Two rings: short boxes at the rim keep MuJoCo's bounding volumes tight, which saved a seventh of a step's time.
    # The outer ring has fewer, broader boxes, and overlaps the inner ring enough to leave no slit.
    outer_boxes = peg.outer_boxes or peg.wall_boxes // 2
    slit = 0.0 if hole.is_polygon else (hole.apothem_m + _RIM_M) * (1.0 - cos(pi / outer_boxes))
    boxes = []
    for count, start, end in ((peg.facets[0], 0.0, _RIM_M), (outer_boxes, _RIM_M - slit, reach_m)):
        half_radial = (end - start + 0.0002) / 2
        for wall in hole.grown(start).walls(count, end - start):
            half_m = (half_radial, wall.half_width_m, half_thickness)
            boxes.append(Box(wall.heading_rad, wall.distance_m + half_radial, half_thickness, half_m))
    side = hole.apothem_m * 2.2
    return [*boxes, Box(0.0, 0.0, depth + 0.0025, (side, side, 0.0025))]


def peg_rings(peg: PegConfig) -> tuple[list[tuple[float, float]], list[tuple[float, float]]]:
    """Return the lateral centre positions of the spheres in the lower and the upper ring."""
    section = peg.section()
    inset_m = peg.rim_radius_mm * 1e-3
    return section.rim(peg.rim_spheres, inset_m), section.rim(peg.upper_spheres or peg.rim_spheres, inset_m)


def mouth_ring(peg: PegConfig) -> list[tuple[float, float]]:
    """Return the centres of the spheres that form the hole's edge, for contact with the peg's shaft."""
    hole = peg.section(peg.clearance_mm)
    return hole.rim(peg.upper_spheres or peg.rim_spheres, -peg.rim_radius_mm * 1e-3)


def peg_corners(peg: PegConfig, length_m: float) -> list[tuple[float, float, float]]:
    """Return a hull-shaped peg's corners, z along its axis and 0 at its end face, with a chamfer there.

    Without a chamfer, the distance at which the peg drops into the hole would vary by a quarter with the time step.
    """
    chamfer_m = (peg.chamfer_mm or peg.rim_radius_mm) * 1e-3
    return [
        (x, y, -height_m)
        for height_m, inset_m in ((0.0, chamfer_m), (chamfer_m, 0.0), (length_m, 0.0))
        for x, y in peg.section().grown(-inset_m).outline(peg.facets[1])
    ]


def outermost_m(ring: list[tuple[float, float]]) -> float:
    """Return the distance of a ring's outermost sphere from the peg's axis."""
    return max(hypot(x, y) for x, y in ring)
