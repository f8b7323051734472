"""Settings derived from the part, the tool, the place, the limits and the sensor, each with a single formula.

All quantities use one consistent system of units: metres, newtons and seconds give the same settings as millimetres,
newtons and seconds. Dimensional constants that are not part of the job are in :class:`Constants`. Figures in
parentheses refer to measurements in the simulated cell (``docs/results.md``).
"""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt
from typing import Annotated, Final

from palpate.core.job.tables import Job
from palpate.core.ports import SensorFacts

N_PER_KGF: Final = 9.80665
_PAPERS_SHARE: Final = 0.7 / (0.5 * 14.5)
"""Torque threshold in the source paper, divided by the pressing force and the peg radius."""
_NOISES_PRESSED: Final = 26.0
"""Pressing force, in standard deviations of the force noise, at which the torque is as clear as in the paper's cell
with the noisiest acceptable sensor."""
_CONTACT_SHARE: Final = 0.2
"""Contact threshold as a fraction of the pressing force, as in the source paper."""
_MOST_CONTACT_SHARE: Final = 0.9
"""Maximum contact threshold as a fraction of the pressing force, even for a sensor too noisy for the job."""
_NOISES_CONTACT: Final = 4.0
"""Contact threshold in standard deviations of the force noise; it yields one false contact in 30 000 samples."""
_NOISES_TORQUE: Final = 2.5
"""Torque threshold in standard deviations of the filtered torque noise."""
NOISE_BAND: Final = 1.11
"""Noise bandwidth of a second-order Butterworth low-pass filter, divided by its cut-off frequency."""
_NOISES_UNEXPECTED: Final = 9.3
"""Bound on the norm of the difference between two samples, in standard deviations of one channel."""
NOISES_FORCE: Final = 2.0 * _NOISES_UNEXPECTED
"""Minimum force limit in standard deviations of the force; below it, the limit for unexpected contact is the same."""
_LETS_GO: Final = 4.0
"""Change in force in one sample, divided by the pressing force, when a peg slips off an edge. The search loads the
gripper with twice that, sqrt(1.3^2 + 1.5^2) from dither and edge; undamped rebound doubles it (2.6 measured)."""
_GAIN_TIMES_LAG: Final = 0.7
"""Force-control gain times the arm's lag. Above 1 the control oscillates; at pi / 2 or more it is unstable."""
JAMS_FROM: Final = 0.8
"""Jam number above which the pressing force during insertion increases."""
_OVER_JAM: Final = 1.3
MOST_PRESS_SHARE: Final = 0.4
"""Maximum pressing force during insertion as a fraction of the force limit; walls and stops add to it."""
_FRICTION_PEAK: Final = 1.3
"""Pressing force at the dither's peak, divided by the mean pressing force."""
_NOISE_SHARE: Final = 0.15
"""Four standard deviations of the force divided by the pressing force, for the noisiest acceptable sensor."""
_STEP_SHARE: Final = 0.2
"""Step length divided by half the width of the area: five steps from the centre to the edge, as in the paper."""
_SWEEP_SLACK: Final = 1.25
"""Search time divided by the time for one sweep of the area."""
_SMALLEST_SWEEP: Final = 1.8
"""Distance between neighbouring paths in a reliable sweep, divided by the capture half-width."""


@dataclass(frozen=True)
class Constants:
    """Dimensional constants that are independent of the job, with the rationale for each.

    Attributes:
        press_N: Pressing force in the source paper, 0.5 kgf; sufficient for sensors with up to 0.19 N of noise.
        most_press_N: Maximum pressing force; above it, pegs stick and slip at a friction coefficient of 0.5.
        speed_in_air_m_s: Speed of the damping controller without contact, as in the paper's cell.
        edge_m: Broken edge on a peg without a chamfer (ISO 13715 allows 0.05 to 0.3 mm).
        search_speed_m_s: Search speed.
        stopped_kg: Effective arm mass stopped by a wall; at 19 mm/s and 40 N/mm, the load on a wedged peg reached 15 N.
        most_capture_m: Maximum capture half-width; beyond it, one path covers most areas and a wider one saves no time.
        capture_delay_s: Reduction in the capture half-width divided by the speed (1.5 to 2 ms).
        area_margin_m: Margin by which the area extends beyond the farthest hole and start, for the last half step.
        search_s: Exploration time in addition to the sweep: first contact, and returns to a likely position.
        least_time_s: Time limit for exploration in the source paper.
        least_unexpected_N: Threshold for an unexpected contact with a quiet sensor and a light tool.
        least_rate_N_s: Force-rate limit never reached by a soft gripper at the paper's pressing force.
        least_torque_Nm: Torque limit never reached by a light contact with a short tool.
        ready_height_m: Ready pose height for a known plate and an untilted tool.
        height_margin_m: Height that remains in the worst case.
        period_s: Control period.
        cutoff_Hz: Cut-off frequency of the perception's low-pass filter.
        lateral_time_s: Time constant for the decay of lateral forces during insertion.
    """

    press_N: float = 0.5 * N_PER_KGF
    most_press_N: float = 10.0
    speed_in_air_m_s: float = 0.012258
    edge_m: float = 1e-4
    search_speed_m_s: float = 0.016
    stopped_kg: float = 15.0
    most_capture_m: float = 2e-3
    capture_delay_s: float = 1.5625e-3
    area_margin_m: float = 5e-4
    search_s: float = 5.0
    least_time_s: float = 20.0
    least_unexpected_N: float = 3.0
    least_rate_N_s: float = 3000.0
    least_torque_Nm: float = 5.0
    ready_height_m: float = 3e-3
    height_margin_m: float = 2e-3
    period_s: float = 1.0 / 140.0
    cutoff_Hz: float = 4.0
    lateral_time_s: float = 0.1


@dataclass(frozen=True)
class Quantities:
    """A job expressed as physical quantities, in the same units as its :class:`Constants`.

    Attributes:
        radius_m: Peg radius, or the radius of its inscribed circle.
        lever_m: Distance from the sensor's origin to the tip.
        deviation_m: Maximum deviation of the hole from its nominal position.
        start_m: Maximum distance from the nominal position to a start.
        height_m: Maximum error in the plate's height.
        mass_kg: Mass of everything on the sensor.
        speed_m_s: Maximum speed in free space.
        lag_s: The arm's lag behind its commands.
    """

    radius_m: float
    clearance_m: float
    depth_m: float
    chamfer_m: float
    friction: float
    tilt_rad: float
    deviation_m: float
    start_m: float
    height_m: float
    lever_m: float
    axial_N_per_m: float
    lateral_N_per_m: float
    tilt_Nm_per_rad: float
    damping_ratio: float
    mass_kg: float
    moving_kg: float
    rigid_kg: float
    force_N: float
    speed_m_s: float
    lag_s: float
    noise_N: float
    noise_Nm: float
    tolerance_m: float

    @classmethod
    def of(cls, job: Job, sensor: SensorFacts) -> Quantities:
        """Return a job's quantities in SI units."""
        part, tool, place = job.part, job.tool, job.place
        return cls(
            radius_m=part.peg_mm * 0.5e-3,
            clearance_m=part.clearance_mm * 1e-3,
            depth_m=part.depth_mm * 1e-3,
            chamfer_m=part.chamfer_mm * 1e-3,
            friction=part.friction_max,
            tilt_rad=place.tilt_uncertainty_mrad * 1e-3,
            deviation_m=place.position_uncertainty_mm * 1e-3,
            start_m=place.start_uncertainty_mm * 1e-3,
            height_m=place.height_uncertainty_mm * 1e-3,
            lever_m=sqrt(sum(each * each for each in tool.tip_mm)) * 1e-3,
            axial_N_per_m=tool.axial_N_per_mm * 1e3,
            lateral_N_per_m=tool.lateral_N_per_mm * 1e3,
            tilt_Nm_per_rad=tool.tilt_Nm_per_rad,
            damping_ratio=tool.damping_ratio,
            mass_kg=tool.mass_kg,
            moving_kg=tool.moving_mass_kg,
            rigid_kg=tool.rigid_mass_kg,
            force_N=job.limits.force_N,
            speed_m_s=job.limits.speed_mm_s * 1e-3,
            lag_s=job.limits.lag_ms * 1e-3,
            noise_N=sensor.noise_N,
            noise_Nm=sensor.noise_Nm,
            tolerance_m=part.depth_tolerance_mm * 1e-3,
        )


@dataclass(frozen=True)
class Derived:
    """Derived quantities, in the same units as their inputs; the annotations describe them."""

    press_N: Annotated[float, "pressing force of the search"]
    insertion_press_N: Annotated[float, "pressing force of the insertion"]
    contact_N: Annotated[float, "reaction force that counts as contact"]
    torque_Nm: Annotated[float, "torque about the tip that points at the hole"]
    damping_N_s_per_m: Annotated[float, "damping along the tool"]
    lateral_m_per_N_s: Annotated[float, "integral gain of the lateral force in the hole"]
    capture_m: Annotated[float, "capture half-width at the search speed"]
    pitch_m: Annotated[float, "distance between neighbouring search paths"]
    slide_m_s: Annotated[float, "highest speed on the plate, at which a wedged peg stops within the force limit"]
    half_width_m: Annotated[float, "half-width of the search area"]
    step_m: Annotated[float, "length of an exploratory step"]
    time_s: Annotated[float, "time limit of the exploration"]
    speed_m_s: Annotated[float, "speed in free space"]
    rate_N_s: Annotated[float, "force rate that stops the arm"]
    unexpected_N: Annotated[float, "force that counts as an unexpected contact"]
    torque_limit_Nm: Annotated[float, "torque about the sensor that stops the arm"]
    ready_height_m: Annotated[float, "height of the ready pose above the plate"]
    end_tilt_m: Annotated[float, "height difference across a tilted peg on the plate, less that in the hole"]


def sliding_N(friction: float, press_N: float) -> float:
    """Return the maximum lateral force on a sliding peg, including effects of dither and noise on pressing force."""
    return (_FRICTION_PEAK * friction + _NOISE_SHARE) * press_N


def wall_force_N(job: Quantities) -> float:
    """Return the maximum force, over all depths, that each of the two walls exerts on a tilted peg.

    A peg tilted by theta fits freely down to l = 2 c / theta. Deeper, its walls bend the gripper back by theta - 2 c /
    l over a lever l. They exert a force of k (theta - 2 c / l) / l, which is largest at l = 4 c / theta.
    """
    if not job.tilt_rad:
        return 0.0
    depth_m = min(job.depth_m, 4.0 * job.clearance_m / job.tilt_rad)
    bent_rad = job.tilt_rad - 2.0 * job.clearance_m / depth_m
    return max(job.tilt_Nm_per_rad * bent_rad / depth_m, 0.0)


def jamming_force_N(job: Quantities) -> float:
    """Return the friction force along the hole that both walls exert on a tilted peg."""
    return 2.0 * job.friction * wall_force_N(job)


def derive(job: Quantities, known: Constants = Constants()) -> Derived:
    """Derive the settings for a job."""
    press_N = min(max(known.press_N, _NOISES_PRESSED * job.noise_N), max(known.most_press_N, known.press_N))
    press_N = min(press_N, MOST_PRESS_SHARE * job.force_N)
    jam_N = jamming_force_N(job)
    insertion_N = press_N
    if jam_N > JAMS_FROM * press_N:
        insertion_N = min(max(press_N, _OVER_JAM * jam_N), MOST_PRESS_SHARE * job.force_N)
    critical_N_s_per_m = sqrt(job.axial_N_per_m * job.moving_kg)
    passed = sqrt(NOISE_BAND * known.cutoff_Hz * 2.0 * known.period_s)
    edge_m = max(known.edge_m, job.chamfer_m)
    # A wall stops the arm at v sqrt(k m), in addition to the sliding peg's force.
    left_N = max(job.force_N - sliding_N(job.friction, press_N), 0.1 * job.force_N)
    slide_m_s = left_N / sqrt(job.lateral_N_per_m * known.stopped_kg)
    search_m_s = min(known.search_speed_m_s, slide_m_s)
    capture_m = min(job.clearance_m + edge_m - known.capture_delay_s * search_m_s, known.most_capture_m)
    half_width_m = max(job.deviation_m, job.start_m) + known.area_margin_m
    side_m = 2.0 * half_width_m
    calm_N = _NOISES_UNEXPECTED * job.noise_N
    # A command changes the speed within one period, and the arm accelerates no faster than commanded.
    kg_s = job.mass_kg / known.period_s
    speed_m_s = min(job.speed_m_s, 0.5 * max(job.force_N - calm_N, 0.5 * job.force_N) / kg_s)
    # Change in one period: released press, or the reaction of the stiffest spring and its damper to a wall.
    k_N_per_m = max(job.axial_N_per_m, job.lateral_N_per_m)
    met_N = (k_N_per_m * known.period_s + 2.0 * job.damping_ratio * sqrt(k_N_per_m * job.moving_kg)) * speed_m_s
    sudden_N = min(max(_LETS_GO * max(press_N, insertion_N), met_N), job.force_N)
    sweep_s = side_m * side_m / (_SMALLEST_SWEEP * capture_m * search_m_s)
    return Derived(
        press_N=press_N,
        insertion_press_N=insertion_N,
        contact_N=min(max(_CONTACT_SHARE * press_N, _NOISES_CONTACT * job.noise_N), _MOST_CONTACT_SHARE * press_N),
        torque_Nm=max(_PAPERS_SHARE * press_N * job.radius_m, _NOISES_TORQUE * passed * job.noise_Nm),
        damping_N_s_per_m=max(
            # Half the stability bound of the sampled controller, with a margin for rounding.
            2.01 * job.axial_N_per_m * known.period_s,
            # An arm that lags by more than about one period becomes unstable sooner.
            job.axial_N_per_m * job.lag_s / _GAIN_TIMES_LAG,
            # The gripper's damper delays the force and hides at most 0.3 of the pressing force.
            2.0 * job.damping_ratio * critical_N_s_per_m / 0.3,
            press_N / known.speed_in_air_m_s,
        ),
        lateral_m_per_N_s=1.0 / (job.lateral_N_per_m * known.lateral_time_s),
        capture_m=capture_m,
        pitch_m=2.0 * capture_m,
        slide_m_s=slide_m_s,
        half_width_m=half_width_m,
        step_m=min(_STEP_SHARE * half_width_m, job.radius_m / 2.0),
        time_s=max(known.least_time_s, known.search_s + _SWEEP_SLACK * sweep_s),
        speed_m_s=speed_m_s,
        rate_N_s=max(known.least_rate_N_s, (sudden_N + calm_N) / known.period_s),
        unexpected_N=max(min(known.least_unexpected_N, 0.5 * job.force_N), calm_N + kg_s * speed_m_s),
        torque_limit_Nm=max(known.least_torque_Nm, job.force_N * (job.lever_m + job.radius_m)),
        # The walls leave the peg the tilt that the clearance allows.
        end_tilt_m=job.radius_m * max(job.tilt_rad - 2.0 * job.clearance_m / job.depth_m, 0.0),
        ready_height_m=max(known.ready_height_m, job.height_m + job.radius_m * job.tilt_rad + known.height_margin_m),
    )
