"""How far the simulated cell is from a rig: driven with the rig's recorded commands, and fitted to what was felt."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from math import inf, sqrt
from pathlib import Path
from typing import Any, Final, TypeAlias

import numpy as np
import numpy.typing as npt
import pinocchio as pin

from palpate.adapters.config import RunConfig, overlay
from palpate.adapters.log import TrialLog, config_of, read_log, tare_of
from palpate.core.errors import ConfigurationError, LogError, UndeterminedError
from palpate.core.motion import Kinematics, ToolGeometry, arm_named
from palpate.core.ports import CONTROL_RATE_HZ, JointVector, Validity
from palpate.core.trial import Outcome, Phase, goal_in_base, wander_m
from palpate.simulation.work_cell import CellConfig, WorkCell

Array: TypeAlias = npt.NDArray[np.float64]

WRENCH_AXES: Final = ("Fx", "Fy", "Fz", "Tx", "Ty", "Tz")
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
_FREE_TICKS: Final = 60
_TOUCH_TICKS: Final = 20
_SETTLED: Final = slice(15, 40)
_BEFORE_TICKS: Final = 10
_PRESSING_N: Final = 0.5
_ALONG: Final = (2,)
_ACROSS: Final = (0, 1)
_FRICTIONS: Final = (0.35, 0.5, 0.7, 0.8, 0.9, 1.1, 1.25, 1.5, 1.8, 2.2)
_DELAYS: Final = (-1.0, -0.75, -0.5, -0.25, 0.25, 0.5, 0.75, 1.0)
"""In control ticks: between two of them, a touch that comes later looks much like a plate that is lower."""
_ROUNDS: Final = 12
_PASSES: Final = 2
_DONE: Final = 1e-3
_ROBUST: Final = 4.0
_UNKNOWN: Final = 0.2
"""A parameter whose standard deviation is above this share of it is left as it was configured."""


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
_LATE: Final = 5
_PLATE: Final = 4


@dataclass(frozen=True)
class Driven:
    """A recorded trial on the grid of control ticks.

    Attributes:
        ready_rad: The ready pose, (n,).
        command_rad: Commands, (ticks, n).
        joints_rad: What the encoders showed, (ticks, n); NaN where nothing was valid.
        wrench: What was felt, tared, (ticks, 6), frame of the tool; NaN where nothing was valid.
        hole_m: Where the peg came to rest in the hole, (2,), task frame; the goal where it did not.
    """

    path: str
    config: RunConfig
    ready_rad: Array
    command_rad: Array
    joints_rad: Array
    wrench: Array
    hole_m: tuple[float, float]


@dataclass(frozen=True)
class AxisErrors:
    """Root mean squares of recorded minus simulated.

    Attributes:
        wrench: (6,), N and N m.
        joints_rad: (n,).
    """

    wrench: Array
    joints_rad: Array


@dataclass(frozen=True)
class Gap:
    """What a fit came to.

    Attributes:
        before: Errors of the cell as it is configured, with offsets in time taken out.
        joints_late_ms: By how much the encoders are behind the simulated ones.
        noise_N: Standard deviation of a force channel in free air.
        settings: The cell that fits best, as nested tables for a run's TOML file.
    """

    logs: int
    before: AxisErrors
    after: AxisErrors
    values: Array
    sds: Array
    joints_late_ms: float
    noise_N: float
    noise_Nm: float
    settings: Mapping[str, Any]

    def known(self, number: int) -> bool:
        """Whether the logs determine a knob."""
        return bool(self.sds[number] <= _UNKNOWN * abs(self.values[number]))

    @property
    def wrench_late_ms(self) -> float:
        """By how much wrenches are behind the simulated ones."""
        return float(self.values[_LATE]) * 1e3 / CONTROL_RATE_HZ


def driven_from(path: Path) -> Driven:
    """A log's trial, up to where the peg begins to sink.

    Raises:
        LogError: The log cannot be read, or holds no contact.
    """
    log = read_log(path)
    config = config_of(log)
    records = [each for each in log.records() if each.time_ns is not None and each.joints is not None]
    first = {each.name if each.name != "phase" else each.detail: each.tick for each in reversed(log.events)}
    contact = first.get("contact")
    if not records or contact is None:
        raise LogError(str(path), "", "holds no contact", "name logs of trials that touched the plate")
    end = min(first.get(Phase.INSERT.value, inf) - _BEFORE_TICKS, contact + _MOST_TICKS)
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
    begin = touched - _FREE_TICKS
    if begin < 0 or np.isnan(command[begin, 0]):
        raise LogError(str(path), "", "touches as soon as it begins", "name logs of trials that begin above the plate")
    ready = np.array(log.start.ready_rad)
    place = _rest_place(log, config)
    return Driven(str(path), config, ready, command[begin:], places[begin:], wrench[begin:], place)


def _rest_place(log: TrialLog, config: RunConfig) -> tuple[float, float]:
    if log.end is None or log.end.outcome != Outcome.INSERTED.value:
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
        goal_in_base=goal * pin.SE3(np.eye(3), np.array([x, y, -float(values[_PLATE]) * 1e-3])),
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
    return wrench - wrench[_SETTLED].mean(axis=0), joints


def tip_depth_mm(trial: Driven) -> Array:
    """Depth of the tip by the encoders, (ticks, 1), task frame."""
    kinematics, task = Kinematics(arm_named(trial.config.arm), ToolGeometry()), goal_in_base(trial.config.task.goal)
    depths, depth = [], 0.0
    for q_rad in trial.joints_rad:
        if not np.isnan(q_rad[0]):
            kinematics.update(q_rad)
            depth = float(task.actInv(kinematics.tip_position_m)[2]) * 1e3
        depths.append(depth)
    return np.array(depths)[:, None]


def late(trace: Array, ticks: float) -> Array:
    """A trace, (n, k), so many control ticks later; at first its first row."""
    at = np.clip(np.arange(len(trace)) - ticks, 0.0, None)
    whole = at.astype(np.int64)
    rest = (at - whole)[:, None]
    shifted: Array = trace[whole] * (1.0 - rest) + trace[np.minimum(whole + 1, len(trace) - 1)] * rest
    return shifted


class _CellFit:
    """Gauss-Newton with damping over all trials; far residuals count less, because a stick is no slip."""

    def __init__(self, trials: Sequence[Driven], gone_through: Callable[[], object]) -> None:
        self._trials, self._gone_through = trials, gone_through
        self._traces: dict[tuple[float | None, ...], list[tuple[Array, Array]]] = {}
        self.noise = self._noise()
        self.values = np.array([trials[0].config.cell.peg.friction, 1.0, 1.0,
                                trials[0].config.cell.compliance.damping_ratio, 0.0, 0.0])  # fmt: skip

    def traces(self, values: Array, ticks: int | None = None) -> list[tuple[Array, Array]]:
        """Of each trial; simulated once for each setting of the cell."""
        key = (ticks, *values[:_LATE].tolist())
        if key not in self._traces:
            if len(self._traces) > len(KNOBS):
                self._traces.clear()
            self._traces[key] = [drive(trial, values, ticks) for trial in self._trials]
        return self._traces[key]

    def residual(self, values: Array, axes: Sequence[int]) -> Array:
        """Recorded minus simulated wrenches of all trials over the noise, along these axes, (m,)."""
        # What the force along the tool says of the touch is clean before the peg wanders over the hole's edge.
        ticks = _FREE_TICKS + _TOUCH_TICKS if axes == _ALONG else None
        rows = []
        for trial, (wrench, _) in zip(self._trials, self.traces(values, ticks), strict=True):
            rest = (trial.wrench[:ticks] - late(wrench, float(values[_LATE])))[_SETTLED.start :] / self.noise
            rows.append(rest[~np.isnan(rest[:, 0])][:, axes].ravel())
        return np.concatenate(rows)

    def run(self) -> Array:
        """Find the best values; returns their standard deviations.

        Stiffness, damping, plate and delay are asked of the force along the tool as it touches, friction and stiffness
        across of those across: torques say nearly the same, and shake more.
        """
        self._begin()
        sds = self._stage((1, _PLATE, _LATE), _ALONG)
        self.values[2] = self.values[1]
        for _ in range(_PASSES):
            sds = np.minimum(sds, self._stage((1, 3, _PLATE, _LATE), _ALONG))
            self._best_delay()
            self._best_friction()
            sds = np.minimum(sds, self._stage((0, 2), _ACROSS))
        return sds

    def _stage(self, fitted: Sequence[int], axes: Sequence[int]) -> Array:
        knobs = np.array(fitted)
        damping, rest = 1e-2, self.residual(self.values, axes)
        sds = np.full(len(KNOBS), inf)
        for _ in range(_ROUNDS):
            jacobian = self._jacobian(rest, knobs, axes)
            weight = 1.0 / (1.0 + (rest / _ROBUST) ** 2)
            normal = (jacobian * weight[:, None]).T @ jacobian
            slope = (jacobian * weight[:, None]).T @ rest
            excess = float(np.average(rest**2, weights=weight))
            sds[knobs] = np.sqrt(np.diag(np.linalg.pinv(normal)) * max(excess, 1.0))
            moved = False
            for _ in range(5):
                tried = self.values.copy()
                tried[knobs] -= np.linalg.solve(normal + damping * np.diag(np.diag(normal) + 1e-12), slope)
                tried = np.array([np.clip(v, k.low, k.high) for v, k in zip(tried, KNOBS, strict=True)])
                rest_there = self.residual(tried, axes)
                if _cost(rest_there) < _cost(rest):
                    moved = _cost(rest) - _cost(rest_there) > _DONE * _cost(rest)
                    self.values, rest, damping = tried, rest_there, damping * 0.3
                    break
                damping *= 5.0
            self._gone_through()
            if not moved:
                break
        return sds

    def _begin(self) -> None:
        """Stiffness, plate and delay to start from: a spring whose length is what the encoders show."""
        best = inf
        for delay in np.arange(0.0, 10.0, 0.5):
            depths, forces = [], []
            for trial in self._trials:
                depth_mm = late(tip_depth_mm(trial), float(delay))[: _FREE_TICKS + _TOUCH_TICKS, 0]
                force = -trial.wrench[: _FREE_TICKS + _TOUCH_TICKS, 2]
                pressing = force > _PRESSING_N
                depths.append(depth_mm[pressing])
                forces.append(force[pressing])
            depth, force = np.concatenate(depths), np.concatenate(forces)
            if len(depth) < CONTROL_RATE_HZ // 14 or np.ptp(depth) == 0.0:
                raise UndeterminedError("stiffness", f"{len(depth)} samples under load", "trials that press")
            slope, level = np.polyfit(depth, force, 1)
            cost = float(np.sum((force - level - slope * depth) ** 2))
            if slope > 0.0 and cost < best:
                best = cost
                self.values[1] = slope / self._trials[0].config.cell.compliance.axial_N_per_mm
                # Higher is less deep.
                self.values[[_PLATE, _LATE]] = level / slope, delay

    def _best_delay(self) -> None:
        found, start = self.values, self.values.copy()
        best = _cost(self.residual(found, _ALONG))
        for ticks in _DELAYS:
            self.values = start.copy()
            self.values[_LATE] = max(start[_LATE] + ticks, 0.0)
            self._stage((1, 3, _PLATE), _ALONG)
            if (cost := _cost(self.residual(self.values, _ALONG))) < best:
                best, found = cost, self.values
        self.values = found

    def _best_friction(self) -> None:
        best, start = _cost(self.residual(self.values, _ACROSS)), self.values.copy()
        for share in _FRICTIONS:
            values = start.copy()
            values[0] = start[0] * share
            if (cost := _cost(self.residual(values, _ACROSS))) < best:
                best, self.values = cost, values
        self._gone_through()

    def _jacobian(self, rest: Array, knobs: npt.NDArray[np.int64], axes: Sequence[int]) -> Array:
        columns = []
        for number in knobs:
            knob, beside = KNOBS[number], self.values.copy()
            beside[number] += knob.step if beside[number] + knob.step <= knob.high else -knob.step
            columns.append((self.residual(beside, axes) - rest) / (beside[number] - self.values[number]))
        return np.column_stack(columns)

    def _noise(self) -> Array:
        """Standard deviation of each channel in free air, (6,), a slow change taken out."""
        parts = []
        for trial in self._trials:
            free = trial.wrench[: _FREE_TICKS - _BEFORE_TICKS]
            free = free[~np.isnan(free[:, 0])]
            parts.append(np.diff(free, axis=0).ravel().reshape(-1, 6) / sqrt(2.0))
        rows = np.concatenate(parts)
        if len(rows) < CONTROL_RATE_HZ // 5:
            raise UndeterminedError("noise", f"{len(rows)} samples in free air", "trials that begin above the plate")
        return np.maximum(np.sqrt(np.mean(rows**2, axis=0)), (1e-3,) * 3 + (1e-5,) * 3)


def _cost(rest: Array) -> float:
    return float(np.sum(np.log1p((rest / _ROBUST) ** 2)))


def gap_of(paths: Sequence[Path], gone_through: Callable[[], object]) -> Gap:
    """Drive the cell with the commands of these logs, and fit it to them.

    Raises:
        LogError: A log cannot be read, or holds no contact.
        ConfigurationError: They are not of one cell.
    """
    trials = [driven_from(path) for path in paths]
    config = trials[0].config
    for trial in trials[1:]:
        if trial.config.cell != config.cell or trial.config.arm != config.arm:
            raise ConfigurationError("logs", trial.path, f"logs recorded with the cell and arm of {trials[0].path}")
    fit = _CellFit(trials, gone_through)
    configured = fit.values.copy()
    sds = fit.run()
    values = fit.values
    # As it is configured, but where and when it is: a plate that is elsewhere would hide all else.
    configured[_PLATE], configured[_LATE] = values[_PLATE], values[_LATE]
    joints_late = _joints_late(trials, fit.traces(values))
    known = np.where(sds <= _UNKNOWN * np.abs(values), values, configured)
    cell = cell_with(config.cell, known)
    noise_N, noise_Nm = (float(np.sqrt(np.mean(fit.noise[part] ** 2))) for part in (slice(3), slice(3, 6)))
    sensor = replace(cell.sensor, force_noise_N=_short(noise_N), torque_noise_Nm=_short(noise_Nm))
    springs = cell.compliance
    settings = {
        "cell": {
            "peg": {"friction": _short(cell.peg.friction)},
            "compliance": {
                name: _short(getattr(springs, name))
                for name in (
                    "axial_N_per_mm", "lateral_N_per_mm", "tilt_Nm_per_rad", "torsion_Nm_per_rad", "damping_ratio",
                )
            },
            "sensor": {"force_noise_N": sensor.force_noise_N, "torque_noise_Nm": sensor.torque_noise_Nm},
        }
    }  # fmt: skip
    return Gap(
        len(trials),
        _errors(trials, fit.traces(configured), values[_LATE], joints_late),
        _errors(trials, fit.traces(values), values[_LATE], joints_late),
        values,
        sds,
        joints_late * 1e3 / CONTROL_RATE_HZ,
        noise_N,
        noise_Nm,
        settings,
    )


def _joints_late(trials: Sequence[Driven], traces: Sequence[tuple[Array, Array]]) -> float:
    """By how many ticks the encoders are behind the simulated ones: the least squares over a grid, and a parabola."""
    grid = np.arange(0.0, 20.0, 0.5)
    cost = [
        sum(float(np.nansum((t.joints_rad - late(q, ticks)) ** 2)) for t, (_, q) in zip(trials, traces, strict=True))
        for ticks in grid
    ]
    best = int(np.argmin(cost))
    if not 0 < best < len(grid) - 1:
        return float(grid[best])
    before, here, after = cost[best - 1 : best + 2]
    curve = before - 2.0 * here + after
    return float(grid[best] + 0.25 * (before - after) / curve) if curve > 0.0 else float(grid[best])


def _errors(
    trials: Sequence[Driven], traces: Sequence[tuple[Array, Array]], wrench_late: float, joints_late: float
) -> AxisErrors:
    pairs = list(zip(trials, traces, strict=True))
    wrench = np.concatenate([(t.wrench - late(w, wrench_late))[_SETTLED.start :] for t, (w, _) in pairs])
    joints = np.concatenate([(t.joints_rad - late(q, joints_late))[_SETTLED.start :] for t, (_, q) in pairs])
    return AxisErrors(np.sqrt(np.nanmean(wrench**2, axis=0)), np.sqrt(np.nanmean(joints**2, axis=0)))


def _short(value: float) -> float:
    return float(f"{value:.4g}")
