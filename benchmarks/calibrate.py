"""Commissioning of cells with hidden values, in virtual time: how far off each result is, and a trial by them.

python -m benchmarks.calibrate --draws 20
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from palpate.adapters.config import RunConfig, overlay, scenario
from palpate.adapters.experiments import ChosenPolicy, run_chosen
from palpate.adapters.experiments.calibration import Commissioning
from palpate.adapters.hardware import TurnedForceSensor
from palpate.adapters.mujoco import SimulatedRig
from palpate.core.trial import find_ready_pose
from palpate.simulation.work_cell import HiddenValues

ASKED = {"weight_%": 2.0, "centre_mm": 2.0, "mounting_deg": 0.5, "plate_mm": 0.1, "hole_mm": 0.3, "stiffness_%": 5.0}
POLICY = "torque"


def draw(seed: int) -> Iterator[tuple[str, float]]:
    """How far off each result is, and in the end 1 for an insertion."""
    config = replace(scenario("paper"), seed=seed)
    hidden, ready = HiddenValues.drawn(seed), find_ready_pose(config.arm, config.task)
    with SimulatedRig(config, ready, hidden) as rig:
        rig.prepare(0)
        hole = np.array([0.4, 0.0, 0.02]) + np.array(rig.truth().hole_in_task_m) * [1.0, -1.0, -1.0]
        commissioning = Commissioning(rig, config)
        load, *_ = commissioning.weigh()
        touched = commissioning.touch()
        stiffness = touched.stiffness_N_per_m.value * 1e-3
        found = {"task": {"goal": {"z_mm": touched.height_m.value * 1e3}}}
        found["control"] = {"axial_stiffness_N_per_mm": stiffness}
        commissioning.believe(overlay(config, found))
        x, y, _ = commissioning.insert(load.mounting_deg.value)
        mass = 0.35 + hidden.gripper_kg
        centre = (hidden.gripper_kg * np.array(hidden.centre_of_mass_m) + np.array([0.0, 0.0, 0.3 * 0.09])) / mass
        yield "weight_%", 100.0 * (load.weight_N.value / (9.81 * mass) - 1.0)
        yield "centre_mm", 1e3 * float(np.linalg.norm([e.value for e in load.centre_of_mass_m] - centre))
        yield "mounting_deg", load.mounting_deg.value - hidden.mounting_deg
        yield "plate_mm", 1e3 * (touched.height_m.value - hole[2])
        yield "hole_mm", 1e3 * float(np.hypot(x.value - hole[0], y.value - hole[1]))
        yield "stiffness_%", 100.0 * (stiffness / (5.0 * hidden.axial_share) - 1.0)
        goal = {"x_mm": x.value * 1e3, "y_mm": y.value * 1e3}
        yield (
            "inserted",
            float(
                inserted(
                    overlay(config, {**found, "task": {"goal": {**found["task"]["goal"], **goal}}}),
                    rig,
                    load.mounting_deg.value,
                )
            ),
        )


def inserted(config: RunConfig, rig: SimulatedRig, mounting_deg: float) -> bool:
    """Whether a trial with what was found ends in the hole."""
    ready, chosen = find_ready_pose(config.arm, config.task), ChosenPolicy(POLICY, config)
    rig.ports = replace(rig.ports, force_sensor=TurnedForceSensor(rig.ports.force_sensor, mounting_deg))
    rows = run_chosen(chosen, config, ready, rig, 1)
    return rows[0].success


def main() -> None:
    """Print a line a draw, and the worst of each."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--draws", type=int, default=20)
    parser.add_argument("--first", type=int, default=1000, help="seed of the first draw")
    options = parser.parse_args()
    rows = [dict(draw(options.first + number)) for number in range(options.draws)]
    print("seed", *rows[0], sep="\t")
    for number, row in enumerate(rows):
        print(options.first + number, *(f"{value:.3g}" for value in row.values()), sep="\t")
    for name, most in ASKED.items():
        worst = max(abs(row[name]) for row in rows)
        print(f"{name}: worst {worst:.3g}, asked {most:g}: {'met' if worst <= most else 'NOT MET'}")
    print(f"inserted: {sum(row['inserted'] for row in rows):.0f} of {len(rows)}")


if __name__ == "__main__":
    main()
