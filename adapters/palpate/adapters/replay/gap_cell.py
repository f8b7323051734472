"""A recorded trial, and the simulated cell that is driven with its commands."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from math import inf, sqrt
from pathlib import Path
from typing import Any, Final, TypeAlias

import numpy as np
import numpy.typing as npt
import pinocchio as pin

from palpate.adapters.config import RunConfig, overlay
from palpate.adapters.log import TickRecord, TrialLog, config_of, read_log, tare_of
from palpate.adapters.replay.gap_late import comes_late
from palpate.adapters.replay.gap_wall import Walled, walled_from
from palpate.core.errors import LogError, UndeterminedError
from palpate.core.motion import Kinematics, ToolGeometry, arm_named
from palpate.core.ports import CONTROL_RATE_HZ, JointVector, Validity
from palpate.core.trial import Outcome, Phase, goal_in_base, wander_m
from palpate.simulation.work_cell import CellConfig, WorkCell

Array: TypeAlias = npt.NDArray[np.float64]

_STILL: Final[dict[str, Any]] = {
    # A list of contacts takes longer to make than a short drive to search.
    "contacts": "searched",
    "hole_uncertainty_mm": 0.0, "hole_height_error_mm": 0.0, "tilt_mrad": 0.0, "conditions": {"hole_shift_mm": 0.0},
    "sensor": {
        "force_noise_N": 0.0, "torque_noise_Nm": 0.0, "force_bias_N": 0.0, "torque_bias_Nm": 0.0,
        "encoder_counts_share": 0.0,
    },
}  # fmt: skip
"""Of the cell that is driven: nothing of it is drawn."""
_MOST_TICKS: Final = 3 * CONTROL_RATE_HZ
"""After the first contact."""
FREE_TICKS: Final = 60
"""In free air, before the touch."""
SETTLED: Final = slice(15, 40)
BEFORE_TICKS: Final = 10


@dataclass(frozen=True)
class Knob:
    """A parameter that is fitted."""

    name: str
    step: float
    low: float
    high: float
    of_cell: bool = True


KNOBS: Final = (
    Knob("friction", 0.02, 0.0, 1.5),
    Knob("axial stiffness, share", 0.03, 0.1, 10.0),
    Knob("stiffness across, share", 0.05, 0.1, 10.0),
    Knob("damping ratio", 0.1, 0.05, 5.0),
    Knob("plate higher than believed, mm", 0.01, -4.0, 4.0, False),
    Knob("wrench late, ticks", 0.25, 0.0, 20.0, False),
)
SHARED: Final = slice(4)
"""Knobs of one cell, whatever sensor it is felt with: friction, stiffnesses, damping."""
ACROSS: Final = 2
LATE: Final = 5
PLATE: Final = 4


@dataclass(frozen=True)
class Driven:
    """A recorded trial on the grid of control ticks.

    Attributes:
        ready_rad: The ready pose, (n,).
        command_rad: Commands, (ticks, n).
        joints_rad: What the encoders showed, (ticks, n); NaN where nothing was valid.
        wrench: What was felt, tared, (ticks, 6), frame of the tool; NaN where nothing was valid.
        hole_m: Where the peg came to rest in the hole, (2,), task frame; the goal where it did not.
        walled: What it met in the hole; None where it was not inserted.
        joints_age_ticks: How old angles are when they are read, by their times of measurement, on average.
        doubted: Why others are preferred to it: ``loop`` or ``devices`` came late; ``hole``, the peg sank and was not
            inserted, so nobody knows where the hole is; empty where nothing is wrong.
    """

    path: str
    config: RunConfig
    ready_rad: Array
    command_rad: Array
    joints_rad: Array
    wrench: Array
    hole_m: tuple[float, float]
    walled: Walled | None = None
    joints_age_ticks: float = 0.0
    doubted: str = ""


class UntouchedError(LogError):
    """Nothing was touched in a trial, as where the peg dropped straight into the hole."""


def driven_from(path: Path) -> Driven:
    """A log's trial, up to where the peg begins to sink.

    Raises:
        UntouchedError: It holds no contact.
        LogError: The log cannot be read.
    """
    log = read_log(path)
    config = config_of(log)
    records = [each for each in log.records() if each.time_ns is not None and each.joints is not None]
    first = {each.name if each.name != "phase" else each.detail: each.tick for each in reversed(log.events)}
    contact = first.get("contact")
    if not records or contact is None:
        raise UntouchedError(str(path), "", "holds no contact", "name logs of trials that touched the plate")
    end = min(first.get(Phase.INSERT.value, inf) - BEFORE_TICKS, contact + _MOST_TICKS)
    start_ns = records[0].time_ns or 0
    slots = [round(((each.time_ns or 0) - start_ns) * CONTROL_RATE_HZ / 1e9) for each in records]
    count = next((slot for slot, each in zip(slots, records, strict=True) if each.tick >= end), slots[-1] + 1)
    touched = next(slot for slot, each in zip(slots, records, strict=True) if each.tick >= contact)
    joints = len(records[0].joints.position_rad) if records[0].joints else 0
    command, places = np.full((count, joints), np.nan), np.full((count, joints), np.nan)
    wrench = np.full((count, 6), np.nan)
    bias = np.array(tare_of(log, records).bias)
    for slot, each in zip(slots, records, strict=True):
        if slot >= count:
            break
        if each.applied is not None:
            command[slot:] = each.applied.position_rad
        if each.joints is not None and each.joints.validity is Validity.VALID:
            places[slot] = each.joints.position_rad
        if each.wrench is not None and each.wrench.validity is Validity.VALID:
            wrench[slot] = np.array((*each.wrench.force_N, *each.wrench.torque_Nm)) - bias
    # The last of the way in free air is enough to begin with.
    begin = touched - FREE_TICKS
    if begin < 0 or np.isnan(command[begin, 0]):
        raise LogError(str(path), "", "touches as soon as it begins", "name logs of trials that begin above the plate")
    ready = np.array(log.start.ready_rad)
    place = _rest_place(log, config)
    by_slot = dict(zip(slots, records, strict=True))
    part = {slot: each for slot, each in by_slot.items() if begin <= slot < count}
    return Driven(
        str(path), config, ready, command[begin:], places[begin:], wrench[begin:], place,
        walled_from(log, config, by_slot, bias), _joints_age_ticks(part.values()),
        comes_late(part) or ("hole" if Phase.INSERT.value in first and not _is_inserted(log) else ""),
    )  # fmt: skip


def _joints_age_ticks(records: Iterable[TickRecord]) -> float:
    ages_ns = [(each.time_ns or 0) - each.joints.source_time_ns for each in records if each.joints is not None]
    return float(np.mean(ages_ns)) * CONTROL_RATE_HZ / 1e9


def _is_inserted(log: TrialLog) -> bool:
    return log.end is not None and log.end.outcome == Outcome.INSERTED.value


def _rest_place(log: TrialLog, config: RunConfig) -> tuple[float, float]:
    if not _is_inserted(log):
        return 0.0, 0.0
    last: JointVector = ()
    for record in log.records():
        if record.joints is not None and record.joints.validity is Validity.VALID:
            last = record.joints.position_rad
    kinematics = Kinematics(arm_named(config.arm), ToolGeometry())
    kinematics.update(last)
    x, y, _ = goal_in_base(config.task.goal).actInv(kinematics.tip_position_m)
    return float(x), float(y)


def cell_with(cell: CellConfig, values: Array) -> CellConfig:
    """The configured cell with these values of the knobs."""
    springs = cell.compliance
    across = {
        name: getattr(springs, name) * float(values[2])
        for name in ("lateral_N_per_mm", "tilt_Nm_per_rad", "torsion_Nm_per_rad")
    }
    axial = springs.axial_N_per_mm * float(values[1])
    return replace(
        cell,
        peg=replace(cell.peg, friction=float(values[0])),
        compliance=replace(springs, axial_N_per_mm=axial, damping_ratio=float(values[3]), **across),
    )


def drive(trial: Driven, values: Array, ticks: int | None = None) -> tuple[Array, Array]:
    """What the cell with these values gives under the commands of a trial.

    Returns:
        Wrenches, tared, (ticks, 6); joint angles, (ticks, n).
    """
    config, (x, y) = trial.config, trial.hole_m
    goal = goal_in_base(config.task.goal)
    cell = WorkCell(
        Kinematics(arm_named(config.arm), ToolGeometry()),
        overlay(cell_with(config.cell, values), _STILL),
        goal_in_base=goal * pin.SE3(np.eye(3), np.array([x, y, -float(values[PLATE]) * 1e-3])),
        ready_rad=trial.ready_rad,
        rate_Hz=CONTROL_RATE_HZ,
        wander_m=2.0 * wander_m(config.task),
    )
    commands = trial.command_rad[:ticks]
    cell.place(commands[0])
    wrench, joints = np.empty((len(commands), 6)), np.empty_like(commands)
    for tick, command in enumerate(commands):
        wrench[tick] = cell.measure_wrench()
        joints[tick] = cell.joint_angles()
        cell.command(tuple(command.tolist()))
        cell.advance()
    return wrench - wrench[SETTLED].mean(axis=0), joints


def led_tip_mm(trial: Driven) -> Array:
    """The believed tip by the encoders, (ticks, 3), task frame."""
    kinematics, task = Kinematics(arm_named(trial.config.arm), ToolGeometry()), goal_in_base(trial.config.task.goal)
    places_mm = np.zeros((len(trial.joints_rad), 3))
    for tick, q_rad in enumerate(trial.joints_rad):
        if not np.isnan(q_rad[0]):
            kinematics.update(q_rad)
            places_mm[tick:] = task.actInv(kinematics.tip_position_m) * 1e3
    return places_mm


def free_noise(trials: Sequence[Driven]) -> Array:
    """Standard deviation of each channel in free air, (6,), a slow change taken out."""
    parts = []
    for trial in trials:
        free = trial.wrench[: FREE_TICKS - BEFORE_TICKS]
        free = free[~np.isnan(free[:, 0])]
        parts.append(np.diff(free, axis=0).ravel().reshape(-1, 6) / sqrt(2.0))
    rows = np.concatenate(parts)
    if len(rows) < CONTROL_RATE_HZ // 5:
        raise UndeterminedError("noise", f"{len(rows)} samples in free air", "trials that begin above the plate")
    noise: Array = np.maximum(np.sqrt(np.mean(rows**2, axis=0)), (1e-3,) * 3 + (1e-5,) * 3)
    return noise


def late(trace: Array, ticks: float) -> Array:
    """A trace, (n, k), so many control ticks later; at first its first row."""
    at = np.clip(np.arange(len(trace)) - ticks, 0.0, None)
    whole = at.astype(np.int64)
    rest = (at - whole)[:, None]
    shifted: Array = trace[whole] * (1.0 - rest) + trace[np.minimum(whole + 1, len(trace) - 1)] * rest
    return shifted
