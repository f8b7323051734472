"""How evenly a contour is pressed on: force along its normal, as it is and as the sensor shows it, over seeds.

    python -m benchmarks.surface_follow --seeds 3

Both arms follow a sine of 2 mm and 80 mm wavelength to and fro, 1 m at 20 mm/s, pressing with 4.9 N; then other
frictions, amplitudes, wavelengths and speeds, one at a time. Each seed draws the wave's phase and the sensor's errors.
RMS are of the ticks in which the tool slides, lifts excepted; the true ones are of the force through the wrist without
noise, along the normal of the newest contact of physics.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from math import sqrt
from typing import Any

import numpy as np
from typing_extensions import override

from palpate.adapters.config import RunConfig, overlay, scenario, task_kind
from palpate.adapters.experiments import (
    build_perception,
    build_task,
    comparator,
    ready_pose,
    supervisor_of,
    trial_setup,
)
from palpate.adapters.mujoco import SimulatedRig
from palpate.core.control_loop import LoopObserver, run_trial
from palpate.core.ports import AppliedCommand, JointCommand, Snapshot
from palpate.core.trial import N_PER_KGF, TrialReport

TASK = "surface-follow"
FIRST = 500_000
CONDITIONS: Mapping[str, Mapping[str, Any]] = {
    "as asked": {},
    "friction 0.1": {"cell": {"peg": {"friction": 0.1}}},
    "friction 0.4": {"cell": {"peg": {"friction": 0.4}}},
    "flat": {"cell": {"contour": {"amplitude_mm": 0.0}}},
    "amplitude 4 mm": {"cell": {"contour": {"amplitude_mm": 4.0}}},
    "wavelength 40 mm": {"cell": {"contour": {"wavelength_mm": 40.0}}},
    "speed 10 mm/s": {"task": {"options": {"speed_mm_s": 10.0}}},
    "speed 40 mm/s": {"task": {"options": {"speed_mm_s": 40.0}}},
    "speed 80 mm/s": {"task": {"options": {"speed_mm_s": 80.0}}},
    "damping law alone": {"task": {"options": {"lead_ahead": 0.0}}},
    "physics in half the time step": {"cell": {"substeps": 32}},
}


class TrueForce(LoopObserver):
    """The force through the wrist less the weight, along the contact's normal, at each tick; 0 before contact."""

    def __init__(self, rig: SimulatedRig) -> None:
        self._data, self._site = rig.cell.data, rig.cell.model.site("wrench").id
        self._weight_N, self._normal = self._force_N(), np.zeros(3)
        self.normal_N: list[float] = []

    def _force_N(self) -> np.ndarray:
        rotation = self._data.site_xmat[self._site].reshape(3, 3)
        return np.array(rotation @ self._data.sensordata[:3])

    @override
    def sent(self, snapshot: Snapshot, command: JointCommand, applied: AppliedCommand) -> None:
        if self._data.ncon:
            self._normal = self._data.contact[0].frame[:3].copy()
        self.normal_N.append(abs(float((self._force_N() - self._weight_N) @ self._normal)))


def config_of(arm: str, way_mm: float, condition: Mapping[str, Any]) -> RunConfig:
    config = overlay(overlay(scenario("paper"), task_kind(TASK).preset), {"arm": arm, "task": {"name": TASK}})
    options = {"way_mm": way_mm, **condition.get("task", {}).get("options", {})}
    # However far off: what falls short is to be measured, and not to end as such.
    return overlay(overlay(config, condition), {"task": {"options": {**options, "tolerance_N": 100.0}}})


def one(config: RunConfig, seed: int) -> tuple[TrialReport, float, float]:
    """A trial; its report, the true RMS of the error, and the true peak force."""
    config, ready = overlay(config, {"seed": seed}), ready_pose(config)
    with SimulatedRig(config, ready) as rig:
        rig.prepare(FIRST)
        task = build_task(config, ready, build_perception(config), comparator("none", config, lambda: ()))
        truth = TrueForce(rig)
        report = run_trial(task, rig.ports, trial_setup(config, FIRST), supervisor_of(rig, config, ready), (truth,))
        proofs = [event.tick for event in report.events if event.name == "proof"]
        # From each lift on the tool slides until the next turn's; the lift itself takes less than 60 ticks.
        sliding = [force for begin, end in zip(proofs, [*proofs[1:], report.ticks], strict=True)
                   for force in truth.normal_N[begin + 3 : max(end - 60, begin + 3)]]  # fmt: skip
        error_N = np.array(sliding) - config.task.press_kgf * N_PER_KGF
        return report, sqrt(float(np.mean(error_N**2))) if sliding else float("nan"), rig.truth().peak_force_N


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=2)
    parser.add_argument("--way-mm", type=float, default=1000.0)
    parser.add_argument("--arms", nargs="+", default=["zebra-zero", "ur5"])
    parser.add_argument("--only", default="", help="conditions with this in their name")
    options = parser.parse_args()
    assert options.seeds > 0
    print("| condition | arm | whole ways | RMS measured, N, worst seed | true RMS, N | largest error, N | peak, N |")
    print("|---|---|---|---|---|---|---|")
    for name, condition in CONDITIONS.items():
        for arm in options.arms if options.only in name else ():
            runs = [one(config_of(arm, options.way_mm, condition), seed) for seed in range(options.seeds)]
            details = [
                report.events[-1].detail.split(" m, ")[1].split()
                for report, *_ in runs
                if "RMS" in report.events[-1].detail
            ]
            shown, worst = (max((float(words[i]) for words in details), default=float("nan")) for i in (0, 4))
            outcomes = ", ".join(sorted({report.outcome.value for report, *_ in runs if report.outcome is not None}))
            print(
                f"| {name} | {arm} | {len(details)} of {len(runs)} ({outcomes}) | {shown:.3f} |"
                f" {max(rms for _, rms, _ in runs):.3f} | {worst:.2f} | {max(peak for *_, peak in runs):.1f} |",
                flush=True,
            )


if __name__ == "__main__":
    main()
