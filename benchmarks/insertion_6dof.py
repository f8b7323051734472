"""Insertions in six degrees of freedom: success, time and force over drawn orientations of hole, plate and grip.

    python -m benchmarks.insertion_6dof --shape square --trials 50 --seed 1 --conditions asked
    python -m benchmarks.insertion_6dof --matrix matrix.csv --trials 100 --seed 1
    python -m benchmarks.insertion_6dof --tick

Success is the task's own: inserted, full depth, true peak force below 30 N, with the supervisor on. ``--tick`` is the
processor time of a tick of the core without physics, in turns with that of an insertion by steps across. ``--matrix``
is every shape at every clearance, cell by cell into a file, which the next call goes on from, and the table of it.
"""

from __future__ import annotations

import argparse
import csv
import time
from collections import Counter
from collections.abc import Mapping
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
from typing_extensions import override

from palpate.adapters.config import RunConfig, overlay, scenario, task_kind
from palpate.adapters.experiments import (
    build_task,
    comparator,
    plain_perception,
    ready_pose,
    run_scored_trial,
    supervisor_of,
    trial_setup,
    true_hole_m,
)
from palpate.adapters.experiments.statistics import exact_interval
from palpate.adapters.mujoco import SimulatedRig
from palpate.core.control_loop import LoopObserver, run_trial
from palpate.core.errors import DeviceError
from palpate.core.ports import AppliedCommand, JointCommand, Snapshot

TASK = "insertion-6dof"
FIRST = 500_000
ROUND_POLICY = "hypotheses"
CORNERS = {
    "round": (0, 14.5),
    "square": (4, 20.5),
    "rounded-square": (4, 19.263),
    "triangle": (3, 29.0),
    "hexagon": (6, 16.743),
    "keyed": (0, 11.5),
}
GRIP: Mapping[str, Any] = {"tilt_mrad": 4.0, "conditions": {"tilt_heading": "drawn", "grip_trials": 1}}
CONDITIONS: Mapping[str, Mapping[str, Any]] = {
    "asked": {},
    "friction": {"cell": {"peg": {"friction": 0.4}}},
    "tight": {"cell": {"peg": {"clearance_mm": 0.04}}},
    "tightest": {"cell": {"peg": {"clearance_mm": 0.02}}},
    "yaw-10": {"cell": {"conditions": {"yaw_deg": 10.0}}},
}
ON_DIAMETER_MM = (2.0, 0.5, 0.1, 0.04)


def world_of(shape: str) -> Mapping[str, Any]:
    """The world that is asked: a round peg in a grip that leans, others in a hole that is turned, too."""
    if shape == "round":
        return {"cell": GRIP, "task": {"area_half_width_mm": 3.5}}
    turned = {**GRIP["conditions"], "yaw_deg": 5.0, "plate_lean_mrad": 17.5}
    return {"cell": {**GRIP, "hole_uncertainty_mm": 3.0, "conditions": turned, "peg": {"cross_section": shape}}}


def config_of(shape: str, conditions: str, arm: str, options: Mapping[str, Any]) -> RunConfig:
    corners, corner_mm = CORNERS[shape]
    config = overlay(overlay(scenario("paper"), task_kind(TASK).preset), {"arm": arm, "task": {"name": TASK}})
    config = overlay(overlay(config, world_of(shape)), CONDITIONS[conditions])
    own = {"corners": float(corners), "corner_mm": corner_mm} if corners else {"corner_mm": corner_mm}
    own |= {"inside_mm": 8.0} if shape == "triangle" else {}
    if shape == "keyed":
        own = {"corner_mm": corner_mm, "flat_deg": 37.5, "inside_mm": 7.0, "lean_deg": 7.0}
    return overlay(config, {"task": {"options": {**own, **options}}})


Row = tuple[int, str, bool, float, float, int, str]


def trials(config: RunConfig, policy: str, seed: int, numbers: range) -> list[Row]:
    """Trial, outcome, success, time, true peak force, actions, last event; a trip ends one trial and no more."""
    config = overlay(config, {"seed": seed})
    ready, rows = ready_pose(config), []
    with SimulatedRig(config, ready) as rig:
        perception = plain_perception(config)
        task = build_task(config, ready, perception, comparator(policy, config, lambda: true_hole_m(rig)))
        supervisor = supervisor_of(rig, config, ready)
        for number in numbers:
            try:
                scored = run_scored_trial(config, rig, task, FIRST + number, None, FIRST, supervisor)
            except DeviceError as error:
                rows.append((number, "error", False, 0.0, 0.0, 0, str(error)))
                continue
            if supervisor.trip is not None:
                rig.latch.acknowledge("benchmark", "the next trial begins anew")
            report = scored.report
            outcome = "none" if report.outcome is None else report.outcome.value
            force = 0.0 if scored.truth is None else scored.truth.peak_force_N
            rows.append((
                number, outcome, scored.success, report.exploration_time_s, force, report.actions,
                report.events[-1].detail,
            ))  # fmt: skip
    return rows


def _job(job: tuple[RunConfig, str, int, range]) -> list[Row]:
    return trials(*job)


def show(rows: list[Row], verbose: bool) -> None:
    for row in rows:
        if verbose or not row[2]:
            print("  {:5d} {:18s} {!s:5s} {:6.2f} s {:5.1f} N {:3d} actions  {}".format(*row))
    good = sum(row[2] for row in rows)
    low, high = exact_interval(good, len(rows), 0.95)
    times = np.array([row[3] for row in rows if row[2]] or [np.nan])
    forces = np.array([row[4] for row in rows])
    print(
        f"{good} of {len(rows)} [{low:.3f} {high:.3f}], median {np.median(times):.2f} s, p95 "
        f"{np.quantile(times, 0.95):.2f} s, max {times.max():.2f} s; peak p99 {np.quantile(forces, 0.99):.1f} N,"
        f" max {forces.max():.1f} N; {dict(Counter(row[1] for row in rows))}"
    )


class Kept(LoopObserver):
    """The snapshots of a trial."""

    def __init__(self) -> None:
        self.snapshots: list[Snapshot] = []

    @override
    def sent(self, snapshot: Snapshot, command: JointCommand, applied: AppliedCommand) -> None:
        self.snapshots.append(snapshot)


def matrix(path: Path, count: int, seed: int, shapes: list[str]) -> None:
    """The cells that the file lacks, and the table of all: the policy's settings are the same at every clearance."""
    fields = ["shape", "on_diameter_mm", "seed", "trials", "good", "median_s", "p95_s", "peak_N"]
    done = list(csv.DictReader(path.open())) if path.exists() else []
    cells = {(row["shape"], float(row["on_diameter_mm"])): row for row in done}
    for shape in shapes:
        config = config_of(shape, "asked", "zebra-zero", {})
        for on_diameter_mm in ON_DIAMETER_MM:
            if (shape, on_diameter_mm) in cells:
                continue
            fitted = overlay(config, {"cell": {"peg": {"clearance_mm": on_diameter_mm / 2}}})
            rows = trials(fitted, ROUND_POLICY if shape == "round" else "corner-first", seed, range(count))
            print(f"{shape}, {on_diameter_mm:g} mm on the diameter, seed {seed}")
            show(rows, verbose=False)
            times = [row[3] for row in rows if row[2]] or [np.nan]
            facts = (
                shape, on_diameter_mm, seed, count, sum(row[2] for row in rows), round(float(np.median(times)), 3),
                round(float(np.quantile(times, 0.95)), 3), round(max(row[4] for row in rows), 1),
            )  # fmt: skip
            cells[shape, on_diameter_mm] = dict(zip(fields, map(str, facts), strict=True))
            with path.open("w", newline="") as file:
                writer = csv.DictWriter(file, fields)
                writer.writeheader()
                writer.writerows(cells.values())
    print("| on the diameter |", " | ".join(f"{each:g} mm" for each in ON_DIAMETER_MM), "|")
    print("|---" * (len(ON_DIAMETER_MM) + 1) + "|")
    for shape in shapes:
        texts = []
        for row in (cells[shape, each] for each in ON_DIAMETER_MM):
            low, high = exact_interval(int(row["good"]), int(row["trials"]), 0.95)
            texts.append(
                f"{row['good']} of {row['trials']} [{low:.3f} {high:.3f}]; {float(row['median_s']):.1f} / "
                f"{float(row['p95_s']):.1f} s; {row['peak_N']} N"
            )
        print(f"| {shape} |", " | ".join(texts), "|")


def tick_costs(rounds: int = 30) -> None:
    """Processor time of a tick of the core, in turns with an insertion by steps across, over recorded snapshots."""
    kept = []
    for config, policy in (
        (scenario("paper"), "torque"),
        (config_of("square", "asked", "zebra-zero", {}), "corner-first"),
    ):
        ready, seen = ready_pose(config), Kept()
        with SimulatedRig(config, ready) as rig:
            rig.prepare(FIRST)
            chosen = comparator(policy, config, lambda: (0.0, 0.0, 0.0))
            task = build_task(config, ready, plain_perception(config), chosen)
            run_trial(task, rig.ports, trial_setup(config, FIRST), supervisor_of(rig, config, ready), [seen])
        kept.append((task, trial_setup(config, FIRST), seen.snapshots))
    costs: list[list[float]] = [[], []]
    for _ in range(rounds):
        for (task, setup, snapshots), cost in zip(kept, costs, strict=True):
            task.begin(setup)
            began = time.thread_time_ns()
            for snapshot in snapshots:
                if task.sense(snapshot) is not None:
                    task.choose()
                task.act()
            cost.append((time.thread_time_ns() - began) / len(snapshots) * 1e-3)
    across, spatial = (float(np.median(cost)) for cost in costs)
    ratio = float(np.median([b / a for a, b in zip(*costs, strict=True)]))
    print(
        f"a tick of the core: {across:.1f} us by steps across, {spatial:.1f} us in six degrees of freedom: {ratio:.2f}"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--shape", choices=CORNERS, default="")
    parser.add_argument("--policy", default="")
    parser.add_argument("--conditions", choices=CONDITIONS, default="asked")
    parser.add_argument("--arm", default="zebra-zero")
    parser.add_argument("--trials", type=int, default=20)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--options", nargs="*", default=[], help="NAME VALUE ... of task.options")
    parser.add_argument("--verbose", action="store_true")
    parser.add_argument("--matrix", type=Path, help="every shape at every clearance, into this file")
    parser.add_argument("--tick", action="store_true", help="what a tick of the core costs, and nothing else")
    told = parser.parse_args()
    if told.tick:
        tick_costs()
        return
    if told.matrix:
        matrix(told.matrix, told.trials, told.seed, [told.shape] if told.shape else list(CORNERS))
        return
    told.shape = told.shape or "square"
    options = {name: float(value) for name, value in zip(told.options[::2], told.options[1::2], strict=True)}
    config = config_of(told.shape, told.conditions, told.arm, options)
    policy = told.policy or (ROUND_POLICY if told.shape == "round" else "corner-first")
    size = -(-told.trials // told.workers)
    ends = range(told.first, told.first + told.trials)
    jobs = [(config, policy, told.seed, ends[k : k + size]) for k in range(0, told.trials, size)]
    if told.workers == 1:
        rows = [row for job in jobs for row in _job(job)]
    else:
        with get_context("spawn").Pool(told.workers) as pool:
            rows = [row for found in pool.map(_job, jobs) for row in found]
    print(f"{told.shape}, {policy}, {told.conditions}, {told.arm}, seed {told.seed}")
    show(rows, told.verbose)


if __name__ == "__main__":
    main()
