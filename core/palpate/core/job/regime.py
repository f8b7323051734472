"""A job's regime: the physical quantities that determine its task and policy.

All quantities use one consistent system of units, as in :mod:`palpate.core.job.derived`.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, pi, sqrt
from typing import Annotated, Final

from palpate.core.job.derived import Constants, Derived, Quantities, jamming_force_N, wall_force_N
from palpate.core.job.verification import AXIAL, Spring, farthest_m

DEVIATIONS: Final = 4.0
"""Tolerance in standard deviations of depth; one floor measurement in 16 000 is outside it."""


@dataclass(frozen=True)
class Regime:
    """A job's quantities, in the same units as their inputs; the annotations describe them."""

    natural_Hz: Annotated[float, "natural frequency of the tool on its gripper"]
    jam_number: Annotated[float, "jam number J: force that jams a tilted peg over the press of the search"]
    jam_depth_m: Annotated[float, "depth at which it jams under that press; inf if it does not"]
    wedge_number: Annotated[float, "wedge number W = mu theta D / 2 c: above 1 two walls may hold a tilted peg"]
    wall_N: Annotated[float, "force of each wall on a tilted peg during the descent"]
    held_N: Annotated[float, "largest friction of both walls against a pull"]
    search_s: Annotated[float, "time to sweep the search area"]
    noise_m: Annotated[float, "standard deviation of depth from force noise"]
    tilted_m: Annotated[float, "the same, from the peg's tilt"]
    step_m: Annotated[float, "the same, from the encoders"]
    depth_m: Annotated[float, "the same, from all three; the tolerance must be at least four times this"]
    dither_N: Annotated[float, "force of the dither that verifies a contact"]
    response_noise_N: Annotated[float, "noise of the response to that dither, with the encoders' noise"]
    window_s: Annotated[float, "duration of that verification"]


def regime_of(job: Quantities, found: Derived, *, step_m: float, known: Constants) -> Regime:
    """Return a job's regime.

    Args:
        found: Settings derived from the job.
        step_m: Standard deviation of the tip position along the tool due to encoder steps.
    """
    jam_N = jamming_force_N(job)
    noise_m, tilted_m, encoder_m = depth_parts_m(job, step_m, known)
    damping_s = 2.0 * job.damping_ratio * sqrt(job.moving_kg / job.axial_N_per_m)
    spring = Spring(job.axial_N_per_m, damping_s, job.rigid_kg, *AXIAL, known.period_s)
    fast_N = farthest_m(found.speed_m_s, known.period_s) * job.axial_N_per_m
    dither_N = min(spring.dither_N(found.press_N, job.noise_N, step_m), fast_N)
    side_m = 2.0 * found.half_width_m
    return Regime(
        natural_Hz=sqrt(job.axial_N_per_m / job.moving_kg) / (2.0 * pi),
        jam_number=jam_N / found.press_N,
        jam_depth_m=_jam_depth_m(job, found.press_N),
        wedge_number=job.friction * job.tilt_rad * job.radius_m / job.clearance_m,
        wall_N=wall_force_N(job),
        held_N=jam_N,
        search_s=side_m * side_m / (found.pitch_m * min(known.search_speed_m_s, found.slide_m_s)),
        noise_m=noise_m,
        tilted_m=tilted_m,
        step_m=encoder_m,
        depth_m=sqrt(noise_m * noise_m + tilted_m * tilted_m + encoder_m * encoder_m),
        dither_N=dither_N,
        response_noise_N=spring.noise_N(job.noise_N, step_m),
        window_s=spring.window_s(job.noise_N, step_m, dither_N),
    )


def depth_parts_m(job: Quantities, step_m: float, known: Constants) -> tuple[float, float, float]:
    """Return the standard deviations in depth due to force noise, tilt and encoders.

    The depth is the difference between two readings, at the floor and at the surface. The gripper's spring and damper
    low-pass filter the force with the time constant tau = 2 zeta sqrt(m / k). A tilt up to theta moves the peg's edge
    by up to R theta relative to its centre, uniformly distributed.
    """
    tau_s = 2.0 * job.damping_ratio * sqrt(job.moving_kg / job.axial_N_per_m)
    passed = sqrt(known.period_s / (known.period_s + 2.0 * tau_s))
    noise_m = sqrt(2.0) * passed * job.noise_N / job.axial_N_per_m
    return noise_m, job.radius_m * job.tilt_rad / sqrt(12.0), sqrt(2.0) * step_m


def largest_tilt_rad(job: Quantities, force_N: float) -> float:
    """Return the maximum tilt at which walls and friction hold a peg with less than the given force."""
    slope = 2.0 * job.friction * job.tilt_Nm_per_rad
    if not slope:
        return inf
    tilt_rad = sqrt(8.0 * job.clearance_m * force_N / slope)
    if tilt_rad * job.depth_m >= 4.0 * job.clearance_m:
        return tilt_rad
    return force_N * job.depth_m / slope + 2.0 * job.clearance_m / job.depth_m


def _jam_depth_m(job: Quantities, press_N: float) -> float:
    """Return the minimum depth l for which 2 mu k (theta - 2 c / l) / l = P."""
    slope = 2.0 * job.friction * job.tilt_Nm_per_rad
    square = (slope * job.tilt_rad) ** 2 - 8.0 * job.clearance_m * slope * press_N
    if square < 0.0:
        return inf
    depth_m = (slope * job.tilt_rad - sqrt(square)) / (2.0 * press_N)
    return depth_m if 0.0 < depth_m <= job.depth_m else inf
