"""How well holes are surveyed by touch: errors of centre, diameter and depth against the truth, over draws.

    python -m benchmarks.hole_survey --trials 20

Each trial draws where three holes lie, each within 4 mm of its place, and the sensor's errors. Conditions are changed
one at a time. "Covered" is the share of all numbers (x, y, diameter, depth of each hole) whose 95 % interval holds the
truth.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from typing import Any

import numpy as np

from palpate.adapters.config import RunConfig, overlay, scenario, task_kind
from palpate.adapters.experiments import (
    build_perception,
    build_task,
    comparator,
    fit_of,
    ready_pose,
    score,
    supervisor_of,
    trial_setup,
)
from palpate.adapters.mujoco import SimulatedRig
from palpate.core.control_loop import run_trial
from palpate.core.tasks.hole_survey import errors_mm, surveyed

TASK = "hole-survey"
FIRST = 500_000
NUMBERS = ("x", "y", "diameter", "depth")
CONDITIONS: Mapping[str, Mapping[str, Any]] = {
    "as it comes": {},
    "hole 7 mm": {"cell": {"peg": {"clearance_mm": 0.5}}, "task": {"options": {"pitch_mm": 0.7}}},
    "hole 14 mm": {
        "cell": {"peg": {"clearance_mm": 4.0}, "more_holes_mm": (0.0, 50.0)},
        "task": {
            "options": {"aside_mm": 16.0, "widest_mm": 16.0, "pitch_mm": 3.0},
            "area_half_width_mm": 11.0,
            "more_goals_mm": (0.0, 50.0),
        },
    },
    "force noise 0.3 N": {"cell": {"sensor": {"force_noise_N": 0.3}}},
    "friction 0.4": {"cell": {"peg": {"friction": 0.4}}},
    "probe leans 4 mrad": {"cell": {"tilt_mrad": 4.0, "tilt_heading_deg": 30.0}},
    "gripper 10 % softer": {"cell": {"compliance": {"axial_N_per_mm": 4.5, "lateral_N_per_mm": 36.0}}},
    "encoders without steps": {"cell": {"sensor": {"encoder_counts_share": 0.0}}},
}  # fmt: skip


def config_of(arm: str, condition: Mapping[str, Any]) -> RunConfig:
    config = overlay(overlay(scenario("paper"), task_kind(TASK).preset), {"arm": arm, "task": {"name": TASK}})
    return overlay(config, condition)


def measured(config: RunConfig, trials: int) -> str:
    """The rest of a line of the table."""
    ready, errors, covered, seconds, peaks, good = ready_pose(config), [], [], [], [], 0
    with SimulatedRig(config, ready) as rig:
        for trial in range(FIRST, FIRST + trials):
            rig.prepare(trial)
            task = build_task(config, ready, build_perception(config), comparator("none", config, lambda: ()))
            supervisor = supervisor_of(rig, config, ready)
            report = run_trial(task, rig.ports, trial_setup(config, trial), supervisor)
            if supervisor.trip is not None:
                rig.latch.acknowledge("benchmark", "the next trial begins anew")
            truth = rig.truth()
            good += bool(score(config, report, truth).success)
            seconds.append(report.exploration_time_s)
            peaks.append(truth.peak_force_N)
            for hole in surveyed(report):
                error = errors_mm(hole, truth, fit_of(config))
                errors.append([error[name] for name in NUMBERS])
                covered += [abs(error[name]) <= getattr(hole, name).within_mm for name in NUMBERS]
    rows = np.array(errors).reshape(-1, len(NUMBERS))
    rms = " | ".join(f"{1e3 * each:.1f}" for each in np.sqrt(np.mean(rows**2, axis=0)))
    return (
        f"{good} of {trials} | {len(rows)} of {trials * (1 + len(config.task.more_places_m))} | {rms} |"
        f" {1e3 * np.abs(rows).max():.1f} | {np.mean(covered):.1%} | {np.median(seconds):.0f} | {max(peaks):.1f} |"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--trials", type=int, default=10)
    parser.add_argument("--arms", nargs="+", default=["zebra-zero", "ur5"])
    parser.add_argument("--only", default="", help="conditions with this in their name")
    options = parser.parse_args()
    assert options.trials > 0
    print(
        "| condition | arm | success | holes | x, um RMS | y | diameter | depth | worst, um | covered | s | peak, N |"
    )
    print("|---|---|---|---|---|---|---|---|---|---|---|---|")
    for name, condition in CONDITIONS.items():
        for arm in options.arms if options.only in name else ():
            print(f"| {name} | {arm} | {measured(config_of(arm, condition), options.trials)}", flush=True)


if __name__ == "__main__":
    main()
