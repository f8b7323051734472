"""Overlap of an ideal round peg with an ideal hole at the pose that a cell has: what rigid bodies would not allow."""

from dataclasses import dataclass
from math import hypot, nan

import numpy as np

_AROUND = np.linspace(0.0, 2.0 * np.pi, 721)


@dataclass(frozen=True)
class Overlap:
    """Depths by which the peg is inside the plate, um; negative: apart, nan: not there.

    Attributes:
        wall_um: Rim of the peg in the wall of the hole.
        mouth_um: Shaft of the peg in the edge of the hole's mouth.
        floor_um: Rim of the peg in the floor.
        total_tilt_mrad: Angle between the axes.
        depth_mm: Depth of the middle of the peg's end.
    """

    wall_um: float
    mouth_um: float
    floor_um: float
    total_tilt_mrad: float
    depth_mm: float


def overlap(bench):
    """That of the peg in its hole, from the true pose of both."""
    peg, data = bench.rig.cell.config.peg, bench.rig.cell.data
    plate, tip = data.body("plate"), data.site("tip")
    turned = plate.xmat.reshape(3, 3).T
    end, axis = turned @ (tip.xpos - plate.xpos), turned @ tip.xmat.reshape(3, 3)[:, 2]
    across = np.cross(axis, [1.0, 0.0, 0.0])
    across /= np.linalg.norm(across)
    circle = np.outer(across, np.cos(_AROUND)) + np.outer(np.cross(axis, across), np.sin(_AROUND))
    radius, edge, hole = peg.diameter_mm * 0.5e-3, (peg.chamfer_mm or peg.rim_radius_mm) * 1e-3, _hole_m(peg)
    rim = (end - axis * edge)[:, None] + (radius - edge) * circle
    side = end[:, None] + radius * circle
    # Where each line along the shaft meets the plate's surface; below the round edge there is no shaft.
    length = side[2] / axis[2]
    mouth = (side - axis[:, None] * length)[:, length > edge]
    return Overlap(
        (np.hypot(rim[0], rim[1]).max() + edge - hole) * 1e6 if end[2] > 2.0 * edge else nan,
        (np.hypot(mouth[0], mouth[1]).max() - hole) * 1e6 if mouth.size else nan,
        (rim[2].max() + edge - peg.hole_depth_mm * 1e-3) * 1e6,
        hypot(axis[0], axis[1]) * 1e3,
        float(end[2]) * 1e3,
    )


def _hole_m(peg):
    return (peg.diameter_mm * 0.5 + peg.clearance_mm) * 1e-3
