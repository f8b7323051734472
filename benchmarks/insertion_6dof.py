"""Insertions in six degrees of freedom: success, time and force for random orientations of hole, plate and grip.

    python -m benchmarks.insertion_6dof --shapes square --trials 50 --jobs 2 --out 6dof.jsonl
    python -m benchmarks.insertion_6dof --on-diameter-mm 2 0.5 0.1 0.04 --trials 100 --out matrix.jsonl
    python -m benchmarks.insertion_6dof --tick

Success is full depth with a true peak force below 30 N and the supervisor enabled. A trip ends only its own trial.
``--tick`` prints the processor time of a core tick without physics, measured in turns with that of a planar insertion.
"""

from __future__ import annotations

import time
from collections import Counter
from itertools import product
from typing import Any

import numpy as np
from typing_extensions import override

from benchmarks.common import Cell, parser_of, seeds_of, sweep, table
from palpate.adapters.config import overlay, scenario
from palpate.adapters.experiments import Run, trial_setup
from palpate.adapters.experiments.statistics import exact_interval
from palpate.core.control_loop import LoopObserver
from palpate.core.ports import AppliedCommand, JointCommand, Snapshot
from tests.support.pegs_6dof import CONDITIONS, FIRST, SHAPES, config_of, trials

BLOCK = 25
HEAD = ("peg", "conditions", "mm on the diameter", "success", "median, p95, most, s", "force p99, most, N", "outcomes")


def run(cell: Cell) -> dict[str, Any]:
    """Run a block of trials."""
    config = config_of(cell["shape"], cell["conditions"], cell["arm"], cell["options"])
    if cell["on_diameter_mm"]:
        config = overlay(config, {"cell": {"peg": {"clearance_mm": cell["on_diameter_mm"] / 2}}})
    end = min((cell["block"] + 1) * BLOCK, cell["trials"])
    return {"trials": trials(config, cell["policy"], cell["seed"], range(cell["block"] * BLOCK, end))}


def line(shape: str, conditions: str, on_diameter_mm: float, rows: list[Any]) -> tuple[object, ...]:
    """Return a row of the table."""
    good = sum(row[2] for row in rows)
    low, high = exact_interval(good, len(rows))
    times_s = np.array([row[3] for row in rows if row[2]] or [np.nan])
    forces_N = np.array([row[4] for row in rows])
    return (
        shape, conditions, on_diameter_mm or "as set", f"{good} of {len(rows)} ({low:.3f} to {high:.3f})",
        f"{np.median(times_s):.2f}, {np.quantile(times_s, 0.95):.2f}, {times_s.max():.2f}",
        f"{np.quantile(forces_N, 0.99):.1f}, {forces_N.max():.1f}", dict(Counter(row[1] for row in rows)),
    )  # fmt: skip


class Kept(LoopObserver):
    """Observer that stores the snapshots of a trial."""

    def __init__(self) -> None:
        self.snapshots: list[Snapshot] = []

    @override
    def sent(self, snapshot: Snapshot, command: JointCommand, applied: AppliedCommand) -> None:
        self.snapshots.append(snapshot)


def tick_costs(rounds: int = 30) -> str:
    """Return processor times of a core tick on recorded snapshots, for planar steps and six degrees of freedom."""
    kept = []
    square = config_of("square", "asked", "zebra-zero", {})
    for config, policy in ((scenario("paper"), "torque"), (square, "corner-first")):
        seen = Kept()
        with Run(config) as of_policy:
            work = of_policy.trials(of_policy.chosen(policy))
            work.run(FIRST, (seen,))
        kept.append((work.task, trial_setup(config, FIRST), seen.snapshots))
    costs_us: list[list[float]] = [[], []]
    for _ in range(rounds):
        for (task, setup, snapshots), cost_us in zip(kept, costs_us, strict=True):
            task.begin(setup)
            began = time.thread_time_ns()
            for snapshot in snapshots:
                if task.sense(snapshot) is not None:
                    task.choose()
                task.act()
            cost_us.append((time.thread_time_ns() - began) / len(snapshots) * 1e-3)
    across_us, spatial_us = (float(np.median(cost)) for cost in costs_us)
    ratio = float(np.median([b / a for a, b in zip(*costs_us, strict=True)]))
    return f"a tick of the core: {across_us:.1f} us by steps across, {spatial_us:.1f} us in six degrees: {ratio:.2f}"


def main() -> None:
    parser = parser_of(__doc__, seeds=1, first_seed=1, trials=20)
    parser.add_argument("--shapes", nargs="+", choices=SHAPES, default=list(SHAPES))
    parser.add_argument("--policy", default="", help="torque for a round peg, else corner-first")
    parser.add_argument("--conditions", choices=CONDITIONS, default="asked")
    parser.add_argument("--on-diameter-mm", nargs="+", type=float, default=[0.0], help="clearances; 0 as set")
    parser.add_argument("--arm", default="zebra-zero")
    parser.add_argument("--options", nargs="*", default=[], help="NAME VALUE ... of task.options")
    parser.add_argument("--verbose", action="store_true", help="list failed trials")
    parser.add_argument("--tick", action="store_true", help="measure a tick of the core, and nothing else")
    options = parser.parse_args()
    if options.tick:
        print(tick_costs())
        return
    own = {name: float(value) for name, value in zip(options.options[::2], options.options[1::2], strict=True)}
    cells = [
        {
            "shape": shape, "conditions": options.conditions, "on_diameter_mm": clearance_mm, "arm": options.arm,
            "policy": options.policy or ("torque" if shape == "round" else "corner-first"), "options": own,
            "seed": seed, "block": block, "trials": options.trials,
        }
        for block in range(-(-options.trials // BLOCK))
        for seed in seeds_of(options)
        for shape, clearance_mm in product(options.shapes, options.on_diameter_mm)
    ]  # fmt: skip
    found = sweep(options, run, cells)
    lines = []
    for shape, clearance_mm in product(options.shapes, options.on_diameter_mm):
        key = (shape, clearance_mm)
        rows = [row for cell, one in found for row in one["trials"] if (cell["shape"], cell["on_diameter_mm"]) == key]
        lines.append(line(shape, options.conditions, clearance_mm, rows))
        for row in rows if options.verbose else []:
            if not row[2]:
                print("{}: trial {} {} {} {:.2f} s {:.1f} N {} actions, {}".format(shape, *row))
    print(table(HEAD, lines))


if __name__ == "__main__":
    main()
