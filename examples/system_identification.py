"""System identification: fit the simulated cell to recorded trials, on a rig or in the simulator.

You see friction, stiffness along and across the tool, damping ratio and delay of the wrench, each with a 95 % interval,
and the force that is left over before and after the fit. The simulated cell is driven with the recorded commands, from
before the touch to where the peg begins to sink; MuJoCo's toolbox minimises what is left between the recorded and the
simulated wrench. Name logs of trials that begin above the plate and slide on it. Takes about a minute for four logs.

Needs ``pip install 'mujoco[sysid]'``: without that extra ``mujoco.sysid`` imports empty.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Sequence
from contextlib import redirect_stdout
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt
import pinocchio as pin
from mujoco import sysid

from palpate.adapters.config import RunConfig, overlay
from palpate.adapters.log import find_logs, read_log, series_of
from palpate.core.errors import LogError
from palpate.core.motion import Kinematics, ToolGeometry, arm_named
from palpate.core.ports import CONTROL_RATE_HZ
from palpate.core.trial import Phase, goal_in_base, wander_m
from palpate.simulation.work_cell import WorkCell

Array: TypeAlias = npt.NDArray[np.float64]
Values: TypeAlias = dict[str, float]

FREE_TICKS = 40
"""In free air, before the touch."""
SETTLED = slice(20, 30)
TOUCHED_TICKS = FREE_TICKS + 20
MOST_TICKS = 280
SMOOTH_TICKS = 5
STEP = 0.05
"""Of a finite difference, as a share of the parameter."""
NOTHING_DRAWN: dict[str, Any] = {
    "contacts": "searched", "hole_uncertainty_mm": 0.0, "hole_height_error_mm": 0.0, "tilt_mrad": 0.0,
    "sensor": {
        "force_noise_N": 0.0, "torque_noise_Nm": 0.0, "force_bias_N": 0.0, "torque_bias_Nm": 0.0,
        "encoder_counts_share": 0.0,
    },
}  # fmt: skip


@dataclass(frozen=True)
class Recorded:
    """The part of a trial that is fitted: commands, (ticks, joints), and tared forces in N, (ticks, 3)."""

    config: RunConfig
    ready_rad: Array
    command_rad: Array
    force_N: Array


def recorded(path: Path) -> Recorded | None:
    """The trial of a log from before the touch to where the peg begins to sink; None where nothing is touched."""
    log = read_log(path)
    series = series_of(log)
    first = {each.detail if each.name == "phase" else each.name: each.tick for each in reversed(log.events)}
    if "contact" not in first:
        return None
    begin = max(first["contact"] - FREE_TICKS, 0)
    end = min(first.get(Phase.INSERT.value, begin + MOST_TICKS) - SMOOTH_TICKS, begin + MOST_TICKS)
    applied = [each.applied.position_rad for each in log.records() if each.applied is not None]
    part = (series.ticks >= begin) & (series.ticks < min(end, len(applied)))
    command = np.array(applied[begin : begin + int(part.sum())])
    return Recorded(series.config, np.array(log.start.ready_rad), command, series.wrench[part, :3])


def simulated_N(trial: Recorded, values: Values) -> Array:
    """Forces of the cell with these values under the commands of a trial, tared, (ticks, 3)."""
    cell = overlay(trial.config.cell, NOTHING_DRAWN)
    springs = cell.compliance
    across = values["across_N_per_mm"] / springs.lateral_N_per_mm
    springs = replace(
        springs, axial_N_per_mm=values["axial_N_per_mm"], lateral_N_per_mm=values["across_N_per_mm"],
        tilt_Nm_per_rad=springs.tilt_Nm_per_rad * across, torsion_Nm_per_rad=springs.torsion_Nm_per_rad * across,
        damping_ratio=values["damping_ratio"],
    )  # fmt: skip
    cell = replace(cell, compliance=springs, peg=replace(cell.peg, friction=values["friction"]))
    higher = pin.SE3(np.eye(3), np.array([0.0, 0.0, (1.0 - values["plate_mm"]) * 1e-3]))
    work_cell = WorkCell(
        Kinematics(arm_named(trial.config.arm), ToolGeometry()),
        cell,
        goal_in_base=goal_in_base(trial.config.task.goal) * higher,
        ready_rad=trial.ready_rad,
        rate_Hz=CONTROL_RATE_HZ,
        wander_m=2.0 * wander_m(trial.config.task),
    )
    work_cell.place(trial.command_rad[0])
    forces = []
    for command in trial.command_rad.tolist():
        forces.append(work_cell.measure_wrench()[:3])
        work_cell.command(tuple(command))
        work_cell.advance()
    force_N: Array = np.array(forces)
    tared: Array = force_N - force_N[SETTLED].mean(axis=0)
    return tared


def late(force_N: Array, ticks: float) -> Array:
    """Forces that come so many control ticks later."""
    at = np.arange(len(force_N))
    shifted: Array = np.column_stack([np.interp(at - ticks, at, axis) for axis in force_N.T])
    return shifted


def left_over_N(trial: Recorded, values: Values, ticks: int | None = None) -> Array:
    """Recorded minus simulated forces to the end or so many ticks, means over SMOOTH_TICKS each, (n, 3)."""
    part = replace(trial, command_rad=trial.command_rad[:ticks], force_N=trial.force_N[:ticks])
    rest = part.force_N - late(simulated_N(part, values), values["delay_ms"] * 1e-3 * CONTROL_RATE_HZ)
    rest = rest[SETTLED.start :]
    rest = rest[~np.isnan(rest[:, 0])]
    means: Array = np.lib.stride_tricks.sliding_window_view(rest, SMOOTH_TICKS, axis=0)[::SMOOTH_TICKS].mean(axis=2)
    return means


def sliding_share(force_N: Array) -> float:
    """Force across over force along the tool, after the touch."""
    rows = force_N[TOUCHED_TICKS:]
    rows = rows[~np.isnan(rows[:, 0])]
    return float(np.hypot(rows[:, 0], rows[:, 1]).sum() / np.abs(rows[:, 2]).sum())


def parameters(config: RunConfig) -> Any:
    """What is fitted, from the configured values on, with bounds; 1 mm is the plate's height where it is believed."""
    peg, springs = config.cell.peg, config.cell.compliance
    told = {
        "friction": (peg.friction, 0.02, 1.5),
        "axial_N_per_mm": (springs.axial_N_per_mm, springs.axial_N_per_mm * 0.1, springs.axial_N_per_mm * 10.0),
        "across_N_per_mm": (springs.lateral_N_per_mm, springs.lateral_N_per_mm * 0.1, springs.lateral_N_per_mm * 10.0),
        "damping_ratio": (springs.damping_ratio, 0.05, 5.0),
        "delay_ms": (10.0, 0.0, 100.0),
        "plate_mm": (1.0, -4.0, 6.0),
    }
    return sysid.ParameterDict({name: sysid.Parameter(name, *values) for name, values in told.items()})


def optimized(start: Any, fitted: Sequence[str], residual: Callable[[Values], list[Array]]) -> tuple[Any, Any]:
    """Fit some of the parameters; returns all of them, and the toolbox's result."""
    free = start.copy()
    for name, each in free.items():
        each.frozen = name not in fitted

    def of(vector: Array, template: Any) -> tuple[list[Array], None, None]:
        tried = template.copy()
        tried.update_from_vector(np.ravel(vector))
        return residual(values_of(tried)), None, None

    settings: dict[str, Any] = {"max_iters": 30, "diff_step": STEP, "x_scale": "jac", "loss": "soft_l1"}
    # The optimiser prints its steps.
    with redirect_stdout(sys.stderr):
        found, result = sysid.optimize(free, of, optimizer="scipy", verbose=False, **settings)
    return found, result


def values_of(some: Any) -> Values:
    """The values by their names."""
    return {name: float(each.value[0]) for name, each in some.items()}


@dataclass(frozen=True)
class Fit:
    """Values, half widths of their 95 % intervals, and what is left over before and after, in N rms."""

    values: Values
    widths: Values
    before_N: float
    after_N: float


def fit(trials: Sequence[Recorded]) -> Fit:
    """Fit the cell to trials of one arm and tool.

    First what touches and sliding tell by themselves: from far off, when a simulated peg sticks and slips is chance.
    """

    def touch(values: Values) -> list[Array]:
        return [left_over_N(trial, values, TOUCHED_TICKS)[:, 2] for trial in trials]

    def slide(values: Values) -> list[Array]:
        shares = [sliding_share(trial.force_N) - sliding_share(simulated_N(trial, values)) for trial in trials]
        return [np.array(shares)]

    def whole(values: Values) -> list[Array]:
        return [left_over_N(trial, values).ravel() for trial in trials]

    start = parameters(trials[0].config)
    found, _ = optimized(start, ("axial_N_per_mm", "delay_ms", "plate_mm"), touch)
    softer = found["axial_N_per_mm"].value / found["axial_N_per_mm"].nominal
    found["across_N_per_mm"].value = found["across_N_per_mm"].value * softer
    found, _ = optimized(found, ("friction",), slide)
    found, result = optimized(found, start.keys(), whole)
    rests = whole(values_of(found))
    _, widths = sysid.calculate_intervals(rests, result.jac)
    before, after = (float(np.sqrt(np.mean(np.concatenate(each) ** 2))) for each in (whole(values_of(start)), rests))
    return Fit(values_of(found), dict(zip(start.keys(), np.ravel(widths).tolist(), strict=True)), before, after)


def main() -> None:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("logs", nargs="+", help="logs, or folders of logs, of one arm and tool")
    parser.add_argument("--most", type=int, default=4, help="logs that are used; time grows with them")
    options = parser.parse_args()
    if not hasattr(sysid, "optimize"):
        parser.error("mujoco.sysid is empty: pip install 'mujoco[sysid]'")
    try:
        trials = [trial for trial in map(recorded, find_logs(options.logs)) if trial is not None][: options.most]
    except LogError as error:
        parser.error(str(error))
    if not trials:
        parser.error("no log holds a contact; name logs of trials that touch the plate")
    found = fit(trials)
    for name, value in found.values.items():
        print(f"{name:16} {value:8.3f} +- {found.widths[name]:.3f}")
    print(f"force left over: {found.before_N:.3f} N before, {found.after_N:.3f} N after, {len(trials)} trials")


if __name__ == "__main__":
    main()
