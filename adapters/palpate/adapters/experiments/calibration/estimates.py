"""Estimates from samples measured on a rig. Pure functions return values with standard deviations, or reject the data.

Frames are those of :mod:`palpate.core.motion`. A sensor rotated by an angle about the tool's axis, from x towards y,
reads (c fx + s fy, c fy - s fx) for the (fx, fy) of the tool.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import degrees, floor, hypot, inf, log10, sqrt
from typing import Final, TypeAlias

import numpy as np
import numpy.typing as npt
from scipy.optimize import least_squares

from palpate.core.errors import UndeterminedError

Array: TypeAlias = npt.NDArray[np.float64]

_BATCHES: Final = 10
"""Number of batches per second. Filtered samples are not independent, but the means of batches nearly are."""
_LEAST_SAMPLES: Final = 50
_SINGULAR: Final = 1e5
_WEIGHT_SHARE: Final = 0.01
_CENTRE_M: Final = 1e-3
_MOUNTING_DEG: Final = 0.25
_PLATE_M: Final = 5e-5
_STIFFNESS_SHARE: Final = 0.025
_APART_M: Final = 3e-4
_MISFIT_SHARE: Final = 0.1
"""Maximum deviation from the wrench for a rigid tool, as a fraction of its weight; larger ones have another cause."""


@dataclass(frozen=True)
class Estimate:
    """A number and its standard deviation, in the same unit."""

    value: float
    sd: float

    def text(self, unit: str, scale: float = 1.0) -> str:
        """Return the value with two standard deviations, rounded to two digits of the latter."""
        spread = 2.0 * self.sd * scale
        places = max(0, 1 - floor(log10(spread))) if 0.0 < spread < inf else 3
        return f"{self.value * scale:.{places}f} ± {spread:.{places}f} {unit}"


@dataclass(frozen=True)
class Payload:
    """Load on a force sensor: weight, centre of mass in the tool frame, and sensor angle about the tool axis."""

    weight_N: Estimate
    centre_of_mass_m: tuple[Estimate, Estimate, Estimate]
    mounting_deg: Estimate


def mean_of(wrenches: Array) -> tuple[Array, Array]:
    """Return the mean of samples, (n, 6), and its standard deviation, from batches of correlated samples, (6,) each.

    Raises:
        UndeterminedError: There are too few samples.
    """
    if len(wrenches) < _LEAST_SAMPLES:
        raise UndeterminedError(
            "wrench", f"{len(wrenches)} samples", f"at least {_LEAST_SAMPLES}: hold the pose longer"
        )
    pieces = np.array([piece.mean(axis=0) for piece in np.array_split(wrenches, _BATCHES)])
    return wrenches.mean(axis=0), pieces.std(axis=0, ddof=1) / sqrt(_BATCHES)


def payload(down_in_tool: Array, means: Array, sds: Array) -> Payload:
    """Return the weight, centre of mass and mounting angle from wrenches with the tool stationary in several poses.

    Means and standard deviations are (n, 6), N and N m, as measured.

    Args:
        down_in_tool: Downward unit vectors, (n, 3), in the tool frame given by the encoders.

    Raises:
        UndeterminedError: The poses are insufficient, or the weight of a rigid tool is not the only load.
    """
    start = _linear_load(down_in_tool, means)
    spread = np.maximum(sds, (1e-4,) * 3 + (1e-5,) * 3)

    def residual(x: Array) -> Array:
        misfit: Array = ((_load(x, down_in_tool) - means) / spread).ravel()
        return misfit

    found = least_squares(residual, start, x_scale=np.array([1.0, 0.1, 1.0, 1.0, 1.0, *(0.01,) * 3, *(0.05,) * 3]))
    scale = np.maximum(np.linalg.norm(found.jac, axis=0), 1e-12)
    scaled = found.jac / scale
    if np.linalg.cond(scaled) > _SINGULAR:
        accepted = "poses that tilt the tool about two axes"
        raise UndeterminedError("weight", "the poses do not determine it", accepted)
    # A misfit beyond the noise increases the standard deviations.
    excess = max(1.0, float(found.fun @ found.fun) / max(len(found.fun) - len(start), 1))
    sd = np.sqrt(np.diag(np.linalg.inv(scaled.T @ scaled)) * excess) / scale
    misfit_N = float(np.sqrt(np.mean((_load(found.x, down_in_tool) - means)[:, :3] ** 2)))
    weight, turn = found.x[0], degrees(found.x[1])
    x, y, z = (Estimate(float(found.x[i]), float(sd[i])) for i in (5, 6, 7))
    mounting = Estimate(float((turn + 180.0) % 360.0 - 180.0), degrees(sd[1]))
    load = Payload(Estimate(float(weight), float(sd[0])), (x, y, z), mounting)
    if misfit_N > _MISFIT_SHARE * weight + 3.0 * float(spread[:, :3].mean()):
        problem = f"the forces are {misfit_N:.2g} N different from those of a rigid tool of {weight:.3g} N"
        raise UndeterminedError("weight", problem, "a tool that no cable pulls, and a sensor whose axes are right")
    _require("weight", load.weight_N, _WEIGHT_SHARE * weight, "N", "poses held longer, or tilted further")
    for axis, centre in zip("xyz", load.centre_of_mass_m, strict=True):
        _require(f"centre of mass along {axis}", centre, _CENTRE_M, "m", "poses held longer, or tilted further")
    _require("mounting angle", load.mounting_deg, _MOUNTING_DEG, "degrees", "poses tilted further, or a heavier tool")
    return load


def press(depth_m: Array, force_N: Array, direction: Array) -> tuple[Estimate, Estimate]:
    """Return the depth of the plate's surface in m and the stiffness in N/m from pressing and releasing.

    Args:
        direction: +1 while pressing, -1 while releasing, (n,); friction and delay cause the difference between them.

    Raises:
        UndeterminedError: There are too few samples, or the force does not increase with depth as with a spring.
    """
    if len(depth_m) < _LEAST_SAMPLES or np.ptp(depth_m) == 0.0:
        raise UndeterminedError("stiffness", f"{len(depth_m)} samples under load", "a press that is slower or deeper")
    middle = float(depth_m.mean())
    columns = np.column_stack((depth_m - middle, np.ones_like(depth_m), direction))
    if np.ptp(direction) == 0.0:
        columns = columns[:, :2]
    found, *_ = np.linalg.lstsq(columns, force_N, rcond=None)
    rest = force_N - columns @ found
    # Neighbouring samples are correlated here too, so only one in ten counts as independent.
    covariance = np.linalg.inv(columns.T @ columns) * float(rest @ rest) / (len(rest) - 3) * _BATCHES
    slope, level = float(found[0]), float(found[1])
    sd_slope = sqrt(covariance[0, 0])
    if slope <= 5.0 * sd_slope:
        raise UndeterminedError("stiffness", "force does not grow with depth", "a tool that touches the plate")
    surface = Estimate(middle - level / slope, hypot(sqrt(covariance[1, 1]), level / slope * sd_slope) / slope)
    stiffness = Estimate(slope, sd_slope)
    _require("plate's height", surface, _PLATE_M, "m", "a press that is slower or deeper")
    _require("stiffness", stiffness, _STIFFNESS_SHARE * slope, "N/m", "a press that is slower or deeper")
    return surface, stiffness


def joined(what: str, values: Sequence[Estimate], apart: float, unit: str) -> Estimate:
    """Return the mean of values that should be equal, with their actual scatter.

    Raises:
        UndeterminedError: There are fewer than two values, or they differ by more than ``apart``.
    """
    numbers = np.array([each.value for each in values])
    if len(numbers) < 2:
        raise UndeterminedError(what, f"{len(numbers)} results", "at least two, that may be compared")
    if np.ptp(numbers) > apart:
        shown = ", ".join(f"{number:.4g}" for number in numbers)
        raise UndeterminedError(what, f"{shown} {unit}", f"results no further apart than {apart:.2g} {unit}")
    within = sqrt(sum(each.sd**2 for each in values)) / len(values)
    return Estimate(float(numbers.mean()), hypot(within, float(numbers.std(ddof=1)) / sqrt(len(numbers))))


def hole(places_m: Sequence[tuple[float, float]], play_m: float) -> tuple[Estimate, Estimate]:
    """Return the hole position from rest positions of an inserted peg, which vary within its play.

    Raises:
        UndeterminedError: There are fewer than two positions, or they are too far apart for one hole.
    """
    x, y = (
        joined(f"hole's {axis}", [Estimate(place[k], play_m / sqrt(12.0)) for place in places_m], _APART_M, "m")
        for k, axis in enumerate("xy")
    )
    return x, y


def _load(x: Array, down: Array) -> Array:
    """Return wrenches, (n, 6), from weight, angle (rad), force offset (3), centre of mass (3) and torque offset (3)."""
    force = x[0] * down
    c, s = np.cos(x[1]), np.sin(x[1])
    turn = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    wrenches: Array = np.hstack((force @ turn.T + x[2:5], np.cross(x[5:8], force) @ turn.T + x[8:11]))
    return wrenches


def _linear_load(down: Array, means: Array) -> Array:
    """Return an initial value for the fit, from transverse forces, the mean axial residual and the mean torque."""
    count = len(down)
    if count < 3:
        raise UndeterminedError("weight", f"{count} poses", "at least 3, that tilt the tool about two axes")
    x, y = down[:, 0], down[:, 1]
    ones, none = np.ones(count), np.zeros(count)
    rows = np.vstack((np.column_stack((x, y, ones, none)), np.column_stack((y, -x, none, ones))))
    (across, turned, bx, by), *_ = np.linalg.lstsq(rows, np.concatenate((means[:, 0], means[:, 1])), rcond=None)
    weight = hypot(across, turned)
    bz = float(np.mean(means[:, 2] - weight * down[:, 2]))
    return np.array([weight, np.arctan2(turned, across), bx, by, bz, 0.0, 0.0, 0.0, *means[:, 3:].mean(axis=0)])


def _require(what: str, estimate: Estimate, most: float, unit: str, missing: str) -> None:
    if not estimate.sd <= most < inf:
        problem = f"known to {estimate.sd:.2g} {unit} only, {most:.2g} {unit} are required"
        raise UndeterminedError(what, problem, missing)
