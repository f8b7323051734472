"""Convert derived quantities to settings tables, in the units that the settings use."""

from __future__ import annotations

from math import acos, asin, ceil, cos, degrees, hypot, pi, radians, sin, sqrt
from typing import Any, Final

from palpate.core.job.derived import N_PER_KGF, NOISES_FORCE, Derived, Quantities, derive
from palpate.core.job.tables import KEYED, ROUND, ROUNDED, SIDES, Job, PartConfig
from palpate.core.job.verification import DITHER_SHARE
from palpate.core.ports import CONTROL_RATE_HZ, SensorFacts

_INSERTION_6DOF: Final = "insertion-6dof"
_KNOWN_MM: Final = 0.15
"""Depth accuracy once the surface has been touched; half a soft gripper's dither if that is larger."""
_WEDGED_HIGHER: Final = 0.9 * (1.0 - 0.91)
"""Height of a wedged corner above a properly seated corner, divided by the height difference between a tilted
corner and its neighbours or the tip. The corner is lowered to 0.9 of that difference."""
_USUAL_TILT_DEG: Final = 8.0
_MOST_TILT_DEG: Final = 12.0
"""Maximum tilt that all known arms reach in every direction; small pegs need it."""
_OVER_TILT_DEG: Final = 1.5
"""Tilt in excess of the hole's at which a corner is the peg's lowest point."""
_TWO_WALLS: Final = 1.27
"""Torsional stiffness of a corner between two walls, divided by lateral stiffness times squared axis distance."""
_YAW_SHARE: Final = 0.43
"""Fraction of the torque that yaw compliance removes per tick; 2 is the stability bound."""
_DRIVEN_PUSH_N: Final = 1.0
"""Push on each wall of a wedged corner during a turn."""
_PHASE: Final = 0.6521
"""Phase advance of the gripper's fastest spring per simulation step, rad, as in the paper's cell. At twice this
phase a light peg in a stiff gripper chatters in a tight hole."""
_SLIP: Final = 5.0
"""Distance a peg slips per simulation step, divided by its radial clearance. At higher values the peg is driven
into both walls at once and chatters."""
_LEAST_LEVER_MM: Final = 60.0
"""Minimum inertia lever: the height of the centre of mass above the tip for a tool with a small peg."""
_LEAST_SPEED_MM_S: Final = 1.0
"""Lowest speed that the task accepts."""
_RANGE_SHARE: Final = 0.9
"""Maximum torque limit as a fraction of the sensor's range, so that it trips before the sensor saturates."""
_TURN_RAD: Final = 10e-3
"""Error in tilt and yaw after a corner has been pushed into its corner of the hole."""
_ATTEMPT_S: Final = 6.0
"""Duration of one attempt: pushing, lowering and stopping."""
_KNOWN_POSITION_MM: Final = 1.0
"""Position threshold for the source paper's symbols, relative to the goal, for a known hole."""
_UNKNOWN_POSITION_MM: Final = 50.0
"""Position threshold for an unknown hole, larger than any area, so that the symbols use only the torque."""


def derived_settings(job: Job, sensor: SensorFacts, task: str) -> dict[str, Any]:
    """Return nested tables of all settings derived from a job.

    Args:
        sensor: Noise figures for the job's force sensor.
        task: Task name; insertion-6dof has additional options.

    Raises:
        ConfigurationError: The sensor is too noisy for the force limit.
    """
    least_N = NOISES_FORCE * sensor.noise_N
    accepted = f"at least {least_N:.3g} with a force sensor of {sensor.noise_N:g} N noise, or a quieter sensor"
    job.limits.require("force_N", job.limits.force_N >= least_N, accepted)
    part, tool, place, limits = job.part, job.tool, job.place, job.limits
    found = derive(Quantities.of(job, sensor))
    known, jams = place.position_uncertainty_mm == 0.0, found.insertion_press_N > found.press_N
    tables: dict[str, Any] = {
        "task": {
            "goal": {"x_mm": place.x_mm, "y_mm": place.y_mm, "z_mm": place.z_mm, "rpy_deg": place.rpy_deg},
            "start_uncertainty_mm": place.start_uncertainty_mm,
            "surface_uncertainty_mm": place.height_uncertainty_mm,
            "insertion_depth_mm": part.depth_mm,
            "depth_tolerance_mm": part.depth_tolerance_mm,
            "max_force_N": limits.force_N,
            "travel_speed_mm_s": max(_shown(found.speed_m_s * 1e3), _LEAST_SPEED_MM_S),
            "press_kgf": _shown(found.press_N / N_PER_KGF),
            # 0 uses the pressing force of the search, which the user may have set.
            "insertion_press_kgf": _shown(found.insertion_press_N / N_PER_KGF) if jams else 0.0,
            "friction": part.friction_max,
            "end_tilt_mm": _shown(found.end_tilt_m * 1e3),
            "tilt_mrad": place.tilt_uncertainty_mrad,
            "lever_mm": max(_shown(hypot(corner_distance_mm(part), part.depth_mm)), _LEAST_LEVER_MM),
            "contact_kgf": _shown(found.contact_N / N_PER_KGF),
            "area_half_width_mm": _shown(found.half_width_m * 1e3),
            "step_mm": _shown(found.step_m * 1e3),
            "slide_speed_mm_s": min(_shown(found.slide_m_s * 1e3), 100.0),
            "time_limit_s": _shown(found.time_s),
            "ready_height_mm": _shown(found.ready_height_m * 1e3),
        },
        "control": {
            "axial_stiffness_N_per_mm": tool.axial_N_per_mm,
            "lateral_stiffness_N_per_mm": tool.lateral_N_per_mm,
            "damping_N_s_per_m": _shown(found.damping_N_s_per_m),
            "force_integral_m_per_N_s": _shown(found.lateral_m_per_N_s),
            "moving_mass_kg": tool.moving_mass_kg,
            "rigid_mass_kg": tool.rigid_mass_kg,
            "damping_ratio": tool.damping_ratio,
            "tilt_stiffness_Nm_per_rad": tool.tilt_Nm_per_rad,
        },
        "perception": {
            "torque_threshold_kgf_mm": _shown(found.torque_Nm / N_PER_KGF * 1e3),
            "position_threshold_mm": _KNOWN_POSITION_MM if known else _UNKNOWN_POSITION_MM,
        },
        "learning": {
            # Round both the same way: a pitch of more than twice the capture would leave gaps.
            "belief": {"capture_mm": _shown(found.capture_m * 1e3), "pitch_mm": 2.0 * _shown(found.pitch_m * 5e2)},
        },
        "supervision": _supervision(found, limits.force_N, min(sensor.range_Nm)),
        "cell": _cell(job, found),
    }
    if task == _INSERTION_6DOF:
        tables["task"] |= _spatial(job, found)
    return tables


def _supervision(found: Derived, force_N: float, range_Nm: float) -> dict[str, Any]:
    limits = {
        "max_force_N": (force_N, 30.0),
        "max_force_rate_N_s": (_shown(found.rate_N_s), 3000.0),
        "unexpected_contact_N": (_shown(found.unexpected_N), 3.0),
        "max_torque_Nm": (_shown(min(found.torque_limit_Nm, _RANGE_SHARE * range_Nm)), 5.0),
    }
    # List the job's limits that are weaker than the defaults, as a user would have to.
    weakened = tuple(name for name, (value, usual) in limits.items() if value > usual)
    return {name: value for name, (value, _) in limits.items()} | {"weakened": weakened}


def _substeps(job: Job, found: Derived) -> int:
    """Return the number of simulation steps per control period."""
    part, tool = job.part, job.tool
    stiffness_N_per_m, mass_kg = tool.lateral_N_per_mm * 1e3, tool.moving_mass_kg
    phase = sqrt(stiffness_N_per_m / mass_kg) / CONTROL_RATE_HZ
    # The gripper, bent by friction, is released at the speed F / sqrt(k m).
    slip_m_s = part.friction_max * found.press_N / sqrt(stiffness_N_per_m * mass_kg)
    slips = slip_m_s / CONTROL_RATE_HZ / (part.clearance_mm * 1e-3)
    return max(4, ceil(max(phase / _PHASE, slips / _SLIP) - 1e-6))


def _cell(job: Job, found: Derived) -> dict[str, Any]:
    """Return the simulated cell for a job, with the job's maximum uncertainties."""
    part, tool, place = job.part, job.tool, job.place
    drawn = {"tilt_heading": "drawn", "grip_trials": 1} if place.tilt_uncertainty_mrad else {}
    substeps = _substeps(job, found)
    return {
        "peg": {
            "cross_section": part.shape,
            "diameter_mm": part.peg_mm,
            "clearance_mm": part.clearance_mm,
            "hole_depth_mm": part.floor_mm,
            "corner_radius_mm": part.corner_radius_mm,
            "flat_mm": part.flat_mm,
            "chamfer_mm": part.chamfer_mm,
        },
        "compliance": {
            "lateral_N_per_mm": tool.lateral_N_per_mm,
            "axial_N_per_mm": tool.axial_N_per_mm,
            "tilt_Nm_per_rad": tool.tilt_Nm_per_rad,
            "torsion_Nm_per_rad": tool.torsion_Nm_per_rad,
            "damping_ratio": tool.damping_ratio,
            "moving_mass_kg": tool.moving_mass_kg,
            "rigid_mass_kg": max(tool.rigid_mass_kg, 0.001),
            "centre_of_mass_above_tip_mm": min(max(tool.moving_centre_above_tip_mm, 5.0), 500.0),
        },
        "substeps": min(substeps, 100),
        # With shorter steps a tilted peg sinks further in, so contacts start harder.
        "tilted_impedance": 0.96 if substeps <= 5 else 0.965 if substeps <= 16 else 0.97,
        "hole_uncertainty_mm": place.position_uncertainty_mm,
        "tilt_mrad": place.tilt_uncertainty_mrad,
        "conditions": {"yaw_deg": place.yaw_uncertainty_deg, **drawn},
    }


def _spatial(job: Job, found: Derived) -> dict[str, Any]:
    """Return the settings for insertion in six degrees of freedom, based on the cross-section."""
    part, tool, place = job.part, job.tool, job.place
    sides, corner_mm = SIDES.get(part.shape, 0), corner_distance_mm(part)
    flat_deg = degrees(acos(corner_mm / (part.peg_mm / 2.0))) if part.shape == KEYED else 0.0
    # Height of a tilted corner's neighbours above it, divided by its height below the tip.
    neighbour_height = min(1.0 - cos(2.0 * pi / sides), 1.0) if sides else 1.0
    least_deg = degrees(place.tilt_uncertainty_mrad * 1e-3) + _OVER_TILT_DEG
    most_deg = _USUAL_TILT_DEG if part.shape == ROUND else _MOST_TILT_DEG
    dither_mm = DITHER_SHARE * found.press_N / tool.axial_N_per_mm
    height_mm = max(_KNOWN_MM, 0.5 * dither_mm) / _WEDGED_HIGHER
    tilt_deg = min(max(degrees(asin(min(height_mm / neighbour_height / corner_mm, 1.0))), least_deg), most_deg)
    wall_Nm_per_rad = _TWO_WALLS * tool.lateral_N_per_mm * corner_mm * corner_mm * 1e-3
    yaw_rad_per_Nm = 1.0 / tool.torsion_Nm_per_rad + 1.0 / wall_Nm_per_rad
    held_N = part.friction_max * (found.press_N + 2.0 * _DRIVEN_PUSH_N)
    options = {
        "corners": float(sides),
        "corner_mm": _shown(corner_mm),
        "flat_deg": _shown(flat_deg),
        "tilt_deg": _shown(tilt_deg),
        "most_tilt_deg": max(_USUAL_TILT_DEG, _shown(tilt_deg)),
        "push_yaw_rad_per_Nms": _shown(min(_YAW_SHARE * CONTROL_RATE_HZ * yaw_rad_per_Nm, 100.0)),
        "drive_Nm": _shown(held_N * corner_mm * 1e-3),
        "tool_kg": tool.mass_kg,
        "tool_above_tip_mm": tool.centre_above_tip_mm,
    }
    area_mm, time_s = place.position_uncertainty_mm + 0.5, found.time_s
    if part.shape != ROUND:
        swing_mm = 0.7 * corner_mm * sin(radians(place.yaw_uncertainty_deg))
        half_corner_rad = (pi / 2.0 - pi / sides) if sides else pi / 4.0
        inside_mm = min((place.position_uncertainty_mm + swing_mm) / sin(half_corner_rad), corner_mm)
        options["inside_mm"] = _shown(max(inside_mm, 0.5))
        time_s = max(time_s, _ATTEMPT_S * attempts(part))
        area_mm += inside_mm + 1.0
    return {
        "options": options,
        "time_limit_s": _shown(time_s),
        "area_half_width_mm": _shown(max(area_mm, place.start_uncertainty_mm + 0.5)),
        # The tool turns to the tilt of the hole.
        "end_tilt_mm": _shown(0.5e-3 * part.peg_mm * place.tilt_uncertainty_mrad),
    }


def attempts(part: PartConfig) -> float:
    """Return the expected number of pushes until the yaw of a cornered peg is within the play c / (D / 2)."""
    return max(_TURN_RAD * part.peg_mm / (2.0 * part.clearance_mm), 1.0)


def corner_distance_mm(part: PartConfig) -> float:
    """Return the distance from a peg's axis to its corners or its flat; the radius if it has neither."""
    half_mm, sides = part.peg_mm / 2.0, SIDES.get(part.shape, 0)
    if part.shape == KEYED:
        return half_mm - part.flat_mm
    if part.shape == ROUNDED:
        return (half_mm - part.corner_radius_mm) * sqrt(2.0) + part.corner_radius_mm
    return half_mm / cos(pi / sides) if sides else half_mm


def _shown(value: float) -> float:
    """Round to four significant digits, for readable settings."""
    return float(f"{value:.4g}")
