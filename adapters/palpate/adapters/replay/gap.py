"""How far the simulated cell is from a rig: driven with the rig's recorded commands, and fitted to what was felt."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

import numpy as np

from palpate.adapters.config import RunConfig
from palpate.adapters.replay.gap_cell import (
    ACROSS,
    LATE,
    PLATE,
    SETTLED,
    SHARED,
    Array,
    Driven,
    UntouchedError,
    cell_with,
    driven_from,
    late,
)
from palpate.adapters.replay.gap_fit import CellFit
from palpate.adapters.replay.gap_lag import lag_ticks, smoothed
from palpate.adapters.replay.gap_late import falls_behind
from palpate.adapters.replay.gap_wall import told_by
from palpate.core.errors import ConfigurationError
from palpate.core.motion import arm_named
from palpate.core.ports import CONTROL_RATE_HZ

WRENCH_AXES: Final = ("Fx", "Fy", "Fz", "Tx", "Ty", "Tz")
_UNKNOWN: Final = 0.2
"""A parameter whose standard deviation is above this share of it is left as it was configured."""

_HARDLY: Final = 1e-12
"""Weight of what neither of two sets determines."""


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
        config: What the first log was recorded with.
        doubted: Logs of trials in which the loop or devices came late, or a peg sank that was not inserted. They are
            left out, where there are others.
        before: Errors of the cell as it is configured, with offsets in time taken out.
        cycle_late_ms: By how much wrenches are behind, and the age of the encoders' angles besides. A bus that tells
            set-points and reads angles once in a cycle makes a command wait the longer the younger its angles are, and
            with which of its moments the loop's ticks fall together is another in each run: the sum is free of that.
        joints_late_ms: By how much the encoders are behind the simulated ones.
        lag_ms: Time constant with which the arm follows its set-points beside a delay, as one that smoothes them; part
            of all that is late.
        noise_N: Standard deviation of a force channel in free air.
        settings: The cell that fits best, as nested tables for a run's TOML file.
        walls: What each wall that held a peg says of the stiffness across, a share of the configured one.
    """

    config: RunConfig
    logs: int
    doubted: Mapping[str, int]
    before: AxisErrors
    after: AxisErrors
    values: Array
    sds: Array
    cycle_late_ms: float
    joints_late_ms: float
    lag_ms: float
    noise_N: float
    noise_Nm: float
    settings: Mapping[str, Any]
    walls: Array

    @property
    def wrench_late_sd_ms(self) -> float:
        """Its standard deviation."""
        return float(self.sds[LATE]) * 1e3 / CONTROL_RATE_HZ

    def known(self, number: int) -> bool:
        """Whether the logs determine a knob."""
        return bool(self.sds[number] <= _UNKNOWN * abs(self.values[number]))

    @property
    def wrench_late_ms(self) -> float:
        """By how much wrenches are behind the simulated ones."""
        return float(self.values[LATE]) * 1e3 / CONTROL_RATE_HZ + self.lag_ms


def gap_of(paths: Sequence[Path], gone_through: Callable[[], object]) -> Gap:
    """Drive the cell with the commands of these logs, and fit it to them.

    Raises:
        LogError: A log cannot be read, or none holds a contact.
        ConfigurationError: They are not of one cell.
        UndeterminedError: They do not tell what is asked of them.
    """
    return _fitted(*_followed(_driven(paths), gone_through), gone_through)


def gaps_of(paths: Sequence[Path], before: Sequence[Path], gone_through: Callable[[], object]) -> tuple[Gap, Gap]:
    """Fit the cell to logs and to those of a reference, which are of one cell: friction, springs, damping are shared.

    Each set tells friction, stiffness along and damping by itself at first, and as much as its deviations say counts: a
    set that is misread, be it the first or the reference, has a wrong delay too, and would shift the difference.
    Stiffness across is told by the walls of both, each as much as any other.

    Raises:
        LogError: A log cannot be read, or a set holds no contact.
        ConfigurationError: They are not of one cell, or a log is in both sets.
        UndeterminedError: They do not tell what is asked of them.
    """
    # All that may be refused comes before the first fit, which takes long.
    _require_others(paths, before)
    sets = [_driven(each) for each in (paths, before)]
    _require_alike(sets[1][0], sets[0][0])
    followed = [_followed(each, gone_through) for each in sets]
    first, other = (_fitted(*each, gone_through) for each in followed)
    part = SHARED
    weights = np.array([1.0 / gap.sds[part] ** 2 for gap in (first, other)])
    weights[0, ~weights.any(axis=0)] = _HARDLY
    values, sds, total = first.values.copy(), first.sds.copy(), weights.sum(axis=0)
    values[part] = (weights[0] * first.values[part] + weights[1] * other.values[part]) / total
    sds[part] = 1.0 / np.sqrt(total)
    values[ACROSS], sds[ACROSS] = told_by(np.concatenate([first.walls, other.walls])) or (values[ACROSS], sds[ACROSS])
    shared = replace(first, values=values, sds=sds)
    one, two = (_fitted(*each, gone_through, shared) for each in followed)
    return one, two


def _driven(paths: Sequence[Path]) -> list[Driven]:
    """The trials that touched something; all are of one cell."""
    trials: list[Driven] = []
    for path in paths:
        try:
            trials.append(driven_from(path))
        except UntouchedError:
            if not trials and path is paths[-1]:
                raise
    config = trials[0].config
    for trial in trials[1:]:
        if trial.config.cell != config.cell or trial.config.arm != config.arm:
            raise ConfigurationError("logs", trial.path, f"logs recorded with the cell and arm of {trials[0].path}")
    return trials


def _fitted(trials: Sequence[Driven], lag: float, gone_through: Callable[[], object], same: Gap | None = None) -> Gap:
    """Fit the cell to trials.

    Args:
        lag: With which the arm follows its set-points, control ticks.
        same: What is told of the same cell: friction, stiffnesses and damping are taken from there.
    """
    config, lag_ms = trials[0].config, lag * 1e3 / CONTROL_RATE_HZ
    doubted = Counter(trial.doubted for trial in trials if trial.doubted)
    trials = [trial for trial in trials if not trial.doubted] or trials
    fit = CellFit(trials, gone_through)
    configured = fit.values.copy()
    if same is None:
        sds = fit.run()
    else:
        sds = fit.run_as(same.values)
        sds[SHARED] = same.sds[SHARED]
    values = fit.values
    # As it is configured, but where and when it is: a plate that is elsewhere would hide all else.
    configured[PLATE], configured[LATE] = values[PLATE], values[LATE]
    joints_late = fit.joints_late()
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
        config,
        len(trials),
        doubted,
        _errors(trials, fit.traces(configured), values[LATE], joints_late),
        _errors(trials, fit.traces(values), values[LATE], joints_late),
        values,
        sds,
        fit.with_age_ticks * 1e3 / CONTROL_RATE_HZ + lag_ms,
        joints_late * 1e3 / CONTROL_RATE_HZ + lag_ms,
        lag_ms,
        noise_N,
        noise_Nm,
        settings,
        fit.walls,
    )


def _require_others(paths: Sequence[Path], before: Sequence[Path]) -> None:
    known = {os.path.realpath(path) for path in paths}
    for path in before:
        if os.path.realpath(path) in known:
            raise ConfigurationError("reference", str(path), "other logs than those that are held against it")


def _require_alike(trial: Driven, other: Driven) -> None:
    """The cell as it is configured is the unit of stiffness; a sensor may be another one."""
    cell, known = trial.config.cell, other.config.cell
    if trial.config.arm != other.config.arm or replace(cell, sensor=known.sensor) != known:
        accepted = "a reference is recorded with the arm and, but for its sensor, the cell of the other logs"
        raise ConfigurationError("reference", trial.path, accepted)


def _followed(trials: Sequence[Driven], gone_through: Callable[[], object]) -> tuple[list[Driven], float]:
    """Trials with their commands as the arm follows them, and its lag in control ticks.

    Trials whose joints fell behind the simulated ones are marked.
    """
    fit, begun = CellFit(trials, gone_through), SETTLED.start
    lag = lag_ticks([trial.joints_rad for trial in trials], [q_rad for _, q_rad in fit.traces(fit.values)])
    trials = [replace(trial, command_rad=smoothed(trial.command_rad, lag)) for trial in trials]
    fit = CellFit(trials, gone_through) if lag else fit
    ticks, step_rad = fit.joints_late(), min(arm_named(trials[0].config.arm).encoder_step_rad)
    marked = [
        replace(trial, doubted=trial.doubted or "devices")
        if falls_behind(trial.joints_rad[begun:], late(q_rad, ticks)[begun:], step_rad)
        else trial
        for trial, (_, q_rad) in zip(trials, fit.traces(fit.values), strict=True)
    ]
    return marked, lag


def _errors(
    trials: Sequence[Driven], traces: Sequence[tuple[Array, Array]], wrench_late: float, joints_late: float
) -> AxisErrors:
    pairs = list(zip(trials, traces, strict=True))
    wrench = np.concatenate([(t.wrench - late(w, wrench_late))[SETTLED.start :] for t, (w, _) in pairs])
    joints = np.concatenate([(t.joints_rad - late(q, joints_late))[SETTLED.start :] for t, (_, q) in pairs])
    return AxisErrors(np.sqrt(np.nanmean(wrench**2, axis=0)), np.sqrt(np.nanmean(joints**2, axis=0)))


def _short(value: float) -> float:
    return float(f"{value:.4g}")
