"""System identification: fit the simulated cell to trials recorded on a rig or in the simulator.

The script prints the friction, both stiffnesses of the tool, the damping ratio and the delay of the wrench, each with a
95 % interval, and the residual force before and after the fit. The simulated cell is driven with the recorded commands,
from just before contact until the peg begins to sink. MuJoCo's toolbox minimises the difference between the recorded
and simulated forces. Use logs of trials that begin above the plate and slide on it. Four logs take about a minute.

The script requires ``pip install 'mujoco[sysid]'``; without this extra, ``mujoco.sysid`` is an empty module.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Iterable, Sequence
from contextlib import redirect_stdout
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt
from mujoco import sysid

from palpate.adapters.config import RunConfig, overlay
from palpate.adapters.log import find_logs, read_log, series_of
from palpate.adapters.mujoco import SimulatedRig
from palpate.core.errors import LogError
from palpate.core.ports import CONTROL_RATE_HZ
from palpate.core.trial import Phase, ReadyPose

Array: TypeAlias = npt.NDArray[np.float64]

FREE_TICKS = 40
"""Number of ticks in free space before the contact."""
SETTLED = slice(20, 30)
TOUCHED_TICKS = FREE_TICKS + 20
MOST_TICKS = 280
SMOOTH_TICKS = 5
MOST_ITERATIONS = 30
NOTHING_DRAWN: dict[str, Any] = {
    "contacts": "searched", "hole_uncertainty_mm": 0.0, "hole_height_error_mm": 0.0, "tilt_mrad": 0.0,
    "sensor": {
        "force_noise_N": 0.0, "torque_noise_Nm": 0.0, "force_bias_N": 0.0, "torque_bias_Nm": 0.0,
        "encoder_counts_share": 0.0,
    },
}  # fmt: skip


@dataclass(frozen=True)
class Recorded:
    """The fitted part of a trial, with commands, (ticks, joints), and tared forces in N, (ticks, 3)."""

    config: RunConfig
    ready: ReadyPose
    command_rad: Array
    force_N: Array


def recorded(path: Path) -> Recorded | None:
    """Return the part of a logged trial from just before contact until the peg sinks; None if there is no contact."""
    log = read_log(path)
    series = series_of(log)
    first = {each.detail if each.name == "phase" else each.name: each.tick for each in reversed(log.events)}
    if "contact" not in first:
        return None
    begin = max(first["contact"] - FREE_TICKS, 0)
    end = min(first.get(Phase.INSERT.value, begin + MOST_TICKS) - SMOOTH_TICKS, begin + MOST_TICKS)
    part = (series.ticks >= begin) & (series.ticks < end) & ~np.isnan(series.command_rad[:, 0])
    ready = ReadyPose(np.array(log.start.ready_rad), np.eye(3))
    return Recorded(series.config, ready, series.command_rad[part], series.wrench[part, :3])


def simulated_N(trial: Recorded, parameters: Any) -> Array:
    """Simulate the forces caused by the commands of a trial, tared and delayed, (ticks, 3)."""
    values = {name: float(each.value[0]) for name, each in parameters.items()}
    springs = trial.config.cell.compliance
    across = values["across_N_per_mm"] / springs.lateral_N_per_mm
    fitted = {
        "peg": {"friction": values["friction"]},
        "compliance": {
            "axial_N_per_mm": values["axial_N_per_mm"],
            "lateral_N_per_mm": values["across_N_per_mm"],
            "tilt_Nm_per_rad": springs.tilt_Nm_per_rad * across,
            "torsion_Nm_per_rad": springs.torsion_Nm_per_rad * across,
            "damping_ratio": values["damping_ratio"],
        },
    }
    goal = {"z_mm": trial.config.task.goal.z_mm + values["plate_mm"] - 1.0}
    config = overlay(trial.config, {"cell": NOTHING_DRAWN | fitted, "task": {"goal": goal}})
    work_cell = SimulatedRig(config, trial.ready).cell
    work_cell.place(trial.command_rad[0])
    forces = []
    for command in trial.command_rad.tolist():
        forces.append(work_cell.measure_wrench()[:3])
        work_cell.command(tuple(command))
        work_cell.advance()
    force_N = np.array(forces) - np.mean(forces[SETTLED], axis=0)
    ticks = np.arange(len(force_N))
    measured = ticks - values["delay_ms"] * 1e-3 * CONTROL_RATE_HZ
    return np.column_stack([np.interp(measured, ticks, axis) for axis in force_N.T])


def residual_N(trial: Recorded, parameters: Any) -> Array:
    """Return the recorded minus the simulated forces, both averaged over SMOOTH_TICKS ticks, (n, 3)."""
    rest = (trial.force_N - simulated_N(trial, parameters))[SETTLED.start :]
    rest = rest[~np.isnan(rest[:, 0])]
    means: Array = rest[: len(rest) // SMOOTH_TICKS * SMOOTH_TICKS].reshape(-1, SMOOTH_TICKS, 3).mean(axis=1)
    return means


def sliding_share(force_N: Array) -> float:
    """Return the ratio of the lateral force to the axial force after the contact."""
    across, along = np.hypot(force_N[:, 0], force_N[:, 1]), np.abs(force_N[:, 2])
    return float(np.nansum(across[TOUCHED_TICKS:]) / np.nansum(along[TOUCHED_TICKS:]))


def configured(config: RunConfig) -> Any:
    """Return the parameters to fit with their bounds. For the plate height, 1 mm denotes the nominal height."""
    springs = config.cell.compliance
    axial, across = springs.axial_N_per_mm, springs.lateral_N_per_mm
    bounds = {
        "friction": (config.cell.peg.friction, 0.02, 1.5),
        "axial_N_per_mm": (axial, axial * 0.1, axial * 10.0),
        "across_N_per_mm": (across, across * 0.1, across * 10.0),
        "damping_ratio": (springs.damping_ratio, 0.05, 5.0),
        "delay_ms": (10.0, 0.0, 100.0),
        "plate_mm": (1.0, -4.0, 6.0),
    }
    return sysid.ParameterDict({name: sysid.Parameter(name, *values) for name, values in bounds.items()})


def optimized(start: Any, names: Iterable[str], residual: Callable[[Any], list[Array]]) -> tuple[Any, Any]:
    """Fit the named parameters, and return all parameters and the toolbox's result."""
    free = start.copy()
    for name, each in free.items():
        each.frozen = name not in names

    def of(vector: Array, template: Any) -> tuple[list[Array], None, None]:
        tried = template.copy()
        tried.update_from_vector(np.ravel(vector))
        return residual(tried), None, None

    settings: dict[str, Any] = {"max_iters": MOST_ITERATIONS, "diff_step": 0.05, "x_scale": "jac", "loss": "soft_l1"}
    # The optimiser prints its steps.
    with redirect_stdout(sys.stderr):
        found, result = sysid.optimize(free, of, optimizer="scipy", verbose=False, **settings)
    return found, result


def fit(trials: Sequence[Recorded]) -> None:
    """Fit the cell to trials with a single arm and tool, and print the results.

    Contact and sliding are fitted first, because the stick-slip of the simulated peg is random far from the solution.
    """
    recorded_share = np.array([sliding_share(trial.force_N) for trial in trials])

    touched = [
        replace(trial, command_rad=trial.command_rad[:TOUCHED_TICKS], force_N=trial.force_N[:TOUCHED_TICKS])
        for trial in trials
    ]

    def touch(tried: Any) -> list[Array]:
        return [residual_N(trial, tried)[:, 2] for trial in touched]

    def slide(tried: Any) -> list[Array]:
        return [recorded_share - [sliding_share(simulated_N(trial, tried)) for trial in trials]]

    def whole(tried: Any) -> list[Array]:
        return [residual_N(trial, tried).ravel() for trial in trials]

    start = configured(trials[0].config)
    found, _ = optimized(start, ("axial_N_per_mm", "delay_ms", "plate_mm"), touch)
    softer = found["axial_N_per_mm"].value / found["axial_N_per_mm"].nominal
    found["across_N_per_mm"].value = found["across_N_per_mm"].value * softer
    found, _ = optimized(found, ("friction",), slide)
    found, result = optimized(found, start.keys(), whole)
    before, after = whole(start), whole(found)
    _, widths = sysid.calculate_intervals(after, result.jac)
    print("95 % intervals by the noise alone: other local minima, as stick-slip has them, are not included")
    for (name, each), width in zip(found.items(), np.ravel(widths), strict=True):
        print(f"{name:16} {each.value[0]:8.3f} +- {width:.3f}")
    before_N, after_N = (float(np.sqrt(np.mean(np.concatenate(each) ** 2))) for each in (before, after))
    print(f"residual force: {before_N:.3f} N rms before, {after_N:.3f} N rms after, {len(trials)} trials")


def main() -> None:
    """Parse the command line, and run the script."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("logs", nargs="+", help="logs, or folders with logs, from one arm and tool")
    parser.add_argument("--most", type=int, default=4, help="maximum number of logs to use; more logs take more time")
    options = parser.parse_args()
    if not hasattr(sysid, "optimize"):
        parser.error("mujoco.sysid is empty: pip install 'mujoco[sysid]'")
    try:
        trials = [trial for trial in map(recorded, find_logs(options.logs)) if trial is not None][: options.most]
    except LogError as error:
        parser.error(str(error))
    if not trials:
        parser.error("no log holds a contact; name logs of trials that touch the plate")
    fit(trials)


if __name__ == "__main__":
    main()
