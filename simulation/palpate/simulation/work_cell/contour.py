"""A curved surface and the ball that follows it, made of shapes whose contacts MuJoCo computes exactly."""

from __future__ import annotations

from dataclasses import dataclass
from math import atan2, ceil, cos, hypot, sin, tau
from typing import TYPE_CHECKING, Annotated, ClassVar, Final

from palpate.core.ports import OneOf, Range, Settings

if TYPE_CHECKING:
    import mujoco

FLAT: Final = "none"
_BOX_M: Final = 1e-3
"""Length of each of the contour's boxes; at a radius of 80 mm their centre is 1.6 um off the curve."""
_HALF_THICKNESS_M: Final = 5e-3


@dataclass(frozen=True)
class ContourConfig(Settings):
    """A contour instead of the plate, and a ball instead of the peg; the hole is at the wave's mean height."""

    TABLE: ClassVar[str] = "cell.contour"

    shape: Annotated[str, OneOf(FLAT, "sine")] = FLAT
    """none: the plate with its hole; sine: a sine wave along x."""
    amplitude_mm: Annotated[float, Range(0.0, 20.0)] = 2.0
    """Height of the crests above the mean."""
    wavelength_mm: Annotated[float, Range(5.0, 1000.0)] = 80.0
    """Wavelength of the surface."""
    length_mm: Annotated[float, Range(10.0, 2000.0)] = 260.0
    """Length of the surface along x, and its width."""
    ball_radius_mm: Annotated[float, Range(0.5, 20.0)] = 5.0
    """Radius of the tool's tip."""


def height_m(contour: ContourConfig, x_m: float) -> float:
    """Return the height of the surface above its mean at a distance x from the hole's position."""
    return contour.amplitude_mm * 1e-3 * sin(tau * x_m / (contour.wavelength_mm * 1e-3))


def add_contour(plate: mujoco.MjsBody, contour: ContourConfig, **touching: object) -> None:
    """Add the surface in the plate's frame, z into it, as boxes along its chords, end to end."""
    import mujoco

    count = ceil(contour.length_mm * 1e-3 / _BOX_M)
    first_m = -0.5 * count * _BOX_M
    for number in range(count):
        x0 = first_m + number * _BOX_M
        z0, z1 = -height_m(contour, x0), -height_m(contour, x0 + _BOX_M)
        chord_m, tilt = hypot(_BOX_M, z1 - z0), (z1 - z0) / _BOX_M
        s, c = tilt / hypot(1.0, tilt), 1.0 / hypot(1.0, tilt)
        # The box is turned about y so that its x is along the chord; its centre is half its thickness below the chord.
        half = -0.5 * atan2(s, c)
        plate.add_geom(
            type=mujoco.mjtGeom.mjGEOM_BOX,
            size=(0.5 * chord_m, 0.5e-3 * contour.length_mm, _HALF_THICKNESS_M),
            pos=(x0 + 0.5 * _BOX_M - s * _HALF_THICKNESS_M, 0.0, 0.5 * (z0 + z1) + c * _HALF_THICKNESS_M),
            quat=(cos(half), 0.0, sin(half), 0.0),
            **touching,
        )


def add_ball(peg: mujoco.MjsBody, contour: ContourConfig, **touching: object) -> None:
    """Add the tool's tip; the deepest point of the ball is at the position of the peg's end face."""
    import mujoco

    radius_m = contour.ball_radius_mm * 1e-3
    peg.add_geom(type=mujoco.mjtGeom.mjGEOM_SPHERE, size=(radius_m, 0.0, 0.0), pos=(0.0, 0.0, -radius_m), **touching)
