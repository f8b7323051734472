"""Length and appearance of force arrows in images."""

from collections.abc import Iterable
from math import floor, hypot, log10
from typing import Final, TypeAlias

from PIL import ImageDraw

from palpate.adapters.mujoco.views import Array, View

Point: TypeAlias = tuple[float, float]

FORCE: Final = (196, 22, 42)
ACTION: Final = (18, 92, 190)
_HALO: Final = (255, 255, 255)
_LONGEST: Final = 0.5
"""Length of the longest arrow, as a fraction of the picture height."""
_LEAST_N: Final = 1.0
"""Minimum force that may fill the picture. Lower forces are noise."""


def reference_N(forces_N: Iterable[float]) -> float:
    """Return the scale arrow's force: 1, 2 or 5 times a power of ten, about half the trial's maximum force."""
    half = max([_LEAST_N, *forces_N]) / 2.0
    power = 10.0 ** floor(log10(half))
    return float(max(step for step in (1.0, 2.0, 5.0) if step * power <= half * (1.0 + 1e-9)) * power)


def metres_per_N(reference_N: float, view: View) -> float:
    """Return the arrow length per newton at which a force of five times the reference fits the picture."""
    return _LONGEST / 5.0 / reference_N / view.pixels_per_m(1)


def arrow_pixels(
    view: View, size: tuple[int, int], foot_m: Array, force_N: Array, length_m_per_N: float
) -> tuple[Point, Point]:
    """Return the foot and head, in pixels, of the arrow for a force (3,) at a point (3,), both in the base frame."""
    head_m = foot_m + force_N * length_m_per_N
    return view.pixel_of(foot_m, *size), view.pixel_of(head_m, *size)


def draw_arrow(draw: ImageDraw.ImageDraw, foot: Point, head: Point, width: float, colour: tuple[int, int, int]) -> None:
    """Draw an arrow with a light edge, so that it is visible on any background; all values are in pixels."""
    (x0, y0), (x1, y1) = foot, head
    length = hypot(x1 - x0, y1 - y0)
    if length < width:
        # Too short to show a direction: draw a dot.
        for radius, shade in ((width, _HALO), (width * 0.7, colour)):
            draw.ellipse((x0 - radius, y0 - radius, x0 + radius, y0 + radius), fill=shade)
        return
    ux, uy = (x1 - x0) / length, (y1 - y0) / length
    point = min(3.2 * width, length)

    def at(along: float, across: float) -> Point:
        return x0 + along * ux - across * uy, y0 + along * uy + across * ux

    half, wing, neck = width / 2.0, 1.5 * width, length - point
    outline = [
        at(0, half),
        at(neck, half),
        at(neck, wing),
        at(length, 0),
        at(neck, -wing),
        at(neck, -half),
        at(0, -half),
    ]
    draw.line([*outline, outline[0], outline[1]], fill=_HALO, width=max(round(width * 0.6), 2), joint="curve")
    draw.polygon(outline, fill=colour)
