"""Camera views, and the pixel coordinates of points in them. OpenGL is not needed."""

from dataclasses import dataclass
from math import cos, radians, sin, tan
from typing import Final, TypeAlias

import numpy as np
import numpy.typing as npt

Array: TypeAlias = npt.NDArray[np.float64]

CAMERAS: Final = ("both", "close-up", "arm")
FIELD_OF_VIEW_DEG: Final = 20.0
"""Vertical field of view. It is narrow so that near and far lengths are comparable."""
_PEGS_HIGH: Final = 3.1
"""Height of the close-up, in peg diameters."""
_MARGIN: Final = 1.3


@dataclass(frozen=True)
class View:
    """A camera that looks at a point.

    Attributes:
        azimuth_deg: Viewing direction in the horizontal plane, from the base frame's x towards its y.
        elevation_deg: Elevation of the viewing direction; negative if the camera looks down.
        cut: Whether the near half of the plate is omitted, to show the inside of the hole.
    """

    target_m: tuple[float, float, float]
    distance_m: float
    azimuth_deg: float
    elevation_deg: float
    cut: bool = False

    @property
    def axes(self) -> Array:
        """Right, up and forward directions of the image as rows, (3, 3), base frame."""
        a, e = radians(self.azimuth_deg), radians(self.elevation_deg)
        forward = np.array([cos(e) * cos(a), cos(e) * sin(a), sin(e)])
        right = np.array([sin(a), -cos(a), 0.0])
        return np.array([right, np.cross(right, forward), forward])

    def pixels_per_m(self, height: int) -> float:
        """Return the scale at the target, perpendicular to the line of sight, in an image of this height."""
        return height / (2.0 * self.distance_m * tan(radians(FIELD_OF_VIEW_DEG) / 2.0))

    def pixel_of(self, point_m: Array, width: int, height: int) -> tuple[float, float]:
        """Return the column and row of a point (3,) in an image of this size, measured from the upper left corner."""
        right, up, forward = self.axes @ (np.asarray(point_m) - np.array(self.target_m))
        scale = self.pixels_per_m(height) * self.distance_m / (self.distance_m + forward)
        return width / 2.0 + float(right * scale), height / 2.0 - float(up * scale)


def close_up(mouth_m: Array, diameter_m: float, turned_deg: float = 0.0) -> View:
    """Return a view of the peg and the hole from the side and slightly from above, with the plate cut away.

    Args:
        mouth_m: Centre of the hole's mouth, (3,), base frame.
        diameter_m: Width of the peg.
        turned_deg: Camera angle about the hole axis, chosen so that a polygonal peg shows a corner.
    """
    high = _PEGS_HIGH * diameter_m
    x, y, z = mouth_m.tolist()
    return View((x, y, z + 0.1 * high), _distance(high), 90.0 + turned_deg, -20.0, cut=True)


def whole_arm(points_m: Array) -> View:
    """Return a view from the side and above that shows all of these points (n, 3), base frame."""
    low, high = points_m.min(axis=0), points_m.max(axis=0)
    middle = (low + high) / 2.0
    x, y, z = middle.tolist()
    view = View((x, y, z), 1.0, 125.0, -18.0)
    right, up, _ = view.axes @ (points_m - middle).T
    extent = 2.0 * float(max(np.abs(right).max(), np.abs(up).max()))
    return View(view.target_m, _distance(extent * _MARGIN), view.azimuth_deg, view.elevation_deg)


def _distance(height_m: float) -> float:
    return height_m / (2.0 * tan(radians(FIELD_OF_VIEW_DEG) / 2.0))
