"""Pairs of a peg sphere and a plate box that can touch while the peg is near the hole."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import cos, sin, sqrt
from typing import Final, Self

import numpy as np
import numpy.typing as npt

from palpate.simulation.work_cell.config import CellConfig
from palpate.simulation.work_cell.contact_shapes import UPPER_RING_M, Box, outermost_m, peg_rings

NEAR_M: Final = 2e-3
"""Radius of a near region around the hole's axis, which needs a third of the pairs of a larger one."""
_SLACK_M: Final = 0.25e-3
"""Maximum motion of a sphere in a tick that ends outside the listed region."""
_TILT: Final = 0.02
_TURN: Final = 0.01


@dataclass(frozen=True, slots=True)
class Leeway:
    """Region of peg poses within which the listed pairs are complete.

    Attributes:
        aside_m: Distance of the tip from the hole's axis.
        tilt: Sine of the angle between the axes of the peg and the hole.
        play_m: Distance between the axes of peg and hole at the height of the upper ring, once that ring is in the
            hole.
    """

    aside_m: float
    tilt: float
    turn: float
    play_m: float

    @classmethod
    def of(cls, config: CellConfig, aside_m: float) -> Self:
        """Return the region for a cell's listed pairs."""
        tilt = sin(config.tilt_mrad * 1e-3) + _TILT
        play_m = config.peg.clearance_mm * 1e-3 + UPPER_RING_M * tilt + _SLACK_M
        return cls(aside_m, tilt, _TURN, play_m)


def listed_pairs(config: CellConfig, boxes: list[Box], leeway: Leeway) -> list[tuple[int, int]]:
    """Return pairs (sphere, box) that can touch within the region; the spheres in the lower ring are numbered first."""
    lower, upper = peg_rings(config.peg)
    rings = ((0, lower, leeway.aside_m), (len(lower), upper, leeway.play_m))
    radius_m = config.peg.rim_radius_mm * 1e-3
    pairs: list[tuple[int, int]] = []
    for first, ring, aside_m in rings[: 1 if config.has_shaft else 2]:
        outermost = outermost_m(ring)
        shift_m = aside_m + outermost * (leeway.turn + 1.0 - sqrt(1.0 - leeway.tilt**2)) + radius_m + _SLACK_M
        near = np.argwhere(_beside_m(boxes, ring) <= shift_m)
        pairs += [(first + sphere, box) for sphere, box in near.tolist()]
    # The upper ring never reaches the floor, which is the last box.
    return [(sphere, box) for sphere, box in pairs if sphere < len(lower) or box < len(boxes) - 1]


def _beside_m(boxes: Sequence[Box], points: Sequence[tuple[float, float]]) -> npt.NDArray[np.float64]:
    """Return the lateral distances of points from boxes, (points, boxes), or 0 for points above or below a box."""
    x, y = np.array(points).T[:, :, None]
    c, s, distance_m, half_along_m, half_across_m = np.array(
        [(cos(box.heading_rad), sin(box.heading_rad), box.distance_m, *box.half_m[:2]) for box in boxes]
    ).T
    along = np.abs(c * x + s * y - distance_m) - half_along_m
    across = np.abs(c * y - s * x) - half_across_m
    beside_m: npt.NDArray[np.float64] = np.hypot(np.maximum(along, 0.0), np.maximum(across, 0.0))
    return beside_m
