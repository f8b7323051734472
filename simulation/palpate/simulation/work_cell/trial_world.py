"""Simulated world for a trial, which depends only on the configuration, the seed and the trial number."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import cos, degrees, radians, sin
from typing import Final

import numpy as np
import pinocchio as pin

from palpate.core.ports import Vector3
from palpate.core.trial import TRIALS_OF_A_SERIES, Purpose, draw_in_disc, generator
from palpate.simulation.work_cell.conditions import DRAWN
from palpate.simulation.work_cell.config import CellConfig

Wrench = tuple[float, float, float, float, float, float]
Place = tuple[float, float, float]
_STILL: Final[Wrench] = (0.0,) * 6


@dataclass(frozen=True)
class TrialWorld:
    """Ground truth for a trial.

    Attributes:
        cell: The cell with the tilt heading and the clearance for this trial.
        hole_in_task_m: Centre of the hole's mouth, (3,), in the task frame.
        zero_shift: Shift in the sensor's zero under load, (6,), N and N m, in the sensor frame.
        zero_drift_per_s: Drift rate of the sensor's zero, (6,), N/s and N m/s, in the sensor frame.
        hole_turn_rad: Rotation vector from the task's axes to the hole's, (3,), rad, in the task frame.
        drawn: Quantities other than the hole that vary between trials in this configuration, by name and unit.
    """

    cell: CellConfig
    hole_in_task_m: Place
    zero_shift: Wrench
    zero_drift_per_s: Wrench
    hole_turn_rad: Vector3
    drawn: Mapping[str, float]


def trial_world(config: CellConfig, seed: int, trial: int) -> TrialWorld:
    """Return the world for a trial.

    Args:
        config: The cell with its varying conditions.
        trial: Index of the trial. Batches and wear are counted from the start of its series.
    """
    conditions, peg, drawn = config.conditions, config.peg, dict[str, float]()
    count = trial % TRIALS_OF_A_SERIES
    x, y = draw_in_disc(generator(seed, Purpose.HOLE, trial), config.hole_uncertainty_mm * 1e-3, "disc")
    if conditions.hole_shift_mm:
        rng = generator(seed, Purpose.HOLE_SHIFT, _batch(trial, conditions.hole_shift_trials))
        dx, dy = draw_in_disc(rng, conditions.hole_shift_mm * 1e-3, "disc")
        x, y = x + dx, y + dy
        drawn |= {"hole_shift_x_mm": dx * 1e3, "hole_shift_y_mm": dy * 1e3}
    tilt_deg, zero_deg = config.tilt_heading_deg, conditions.zero_heading_deg
    if conditions.tilt_heading == DRAWN:
        rng = generator(seed, Purpose.GRIP, _batch(trial, conditions.grip_trials))
        drawn["tilt_heading_deg"] = tilt_deg = rng.uniform(-180.0, 180.0)
    if conditions.zero_heading == DRAWN:
        rng = generator(seed, Purpose.ZERO, _batch(trial, conditions.zero_trials))
        drawn["zero_heading_deg"] = zero_deg = rng.uniform(-180.0, 180.0)
    if conditions.wear_mm:
        clearance_mm = peg.clearance_mm + conditions.wear_mm * min(count / conditions.wear_trials, 1.0)
        drawn["clearance_mm"] = clearance_mm
        peg = replace(peg, clearance_mm=clearance_mm)
    turn_rad: Vector3 = (0.0, 0.0, 0.0)
    if conditions.yaw_deg or conditions.plate_tilt_mrad:
        rng = generator(seed, Purpose.PLATE, trial)
        yaw_rad = radians(conditions.yaw_deg * rng.uniform(-1.0, 1.0))
        heading_rad = rng.uniform(-np.pi, np.pi)
        turn_rad = _turn(yaw_rad, conditions.plate_tilt_mrad * 1e-3, heading_rad)
        drawn |= {"hole_yaw_deg": degrees(yaw_rad)} if conditions.yaw_deg else {}
        drawn |= {"plate_heading_deg": degrees(heading_rad)} if conditions.plate_tilt_mrad else {}
    z = -config.hole_height_error_mm * 1e-3
    # Most cells are the same in every trial, and creating a cell checks all its settings.
    same = peg is config.peg and tilt_deg == config.tilt_heading_deg
    return TrialWorld(
        config if same else replace(config, peg=peg, tilt_heading_deg=tilt_deg),
        (x, y, z),
        _across(conditions.zero_shift_N, conditions.zero_shift_Nm, zero_deg),
        _across(conditions.zero_drift_N_s, conditions.zero_drift_Nm_s, zero_deg),
        turn_rad,
        {name: round(value, 6) for name, value in drawn.items()},
    )


def _batch(trial: int, trials: int) -> int:
    """Return the batch of a trial, for random streams; no two series, such as training and evaluation, share one."""
    if not trials:
        return 0
    count = trial % TRIALS_OF_A_SERIES
    return trial - count + count // trials


def _turn(yaw_rad: float, tilt_rad: float, heading_rad: float) -> Vector3:
    """Return the rotation vector of a yaw about the hole's axis, which is tilted towards the heading."""
    tilt = pin.exp3(tilt_rad * np.array([-sin(heading_rad), cos(heading_rad), 0.0]))
    x, y, z = pin.log3(tilt @ pin.exp3(np.array([0.0, 0.0, yaw_rad]))).tolist()
    return x, y, z


def _across(force: float, torque: float, heading_deg: float) -> Wrench:
    """Return a force and a torque with these magnitudes, both along this heading."""
    if not force and not torque:
        return _STILL
    c, s = cos(radians(heading_deg)), sin(radians(heading_deg))
    return force * c, force * s, 0.0, torque * c, torque * s, 0.0
