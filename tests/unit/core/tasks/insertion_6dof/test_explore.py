"""A tool that is caught while it is lifted gives way; no trial without a fault ends in a trip for it."""

import pytest

from palpate.adapters.config import RunConfig, overlay, scenario, task_kind
from palpate.adapters.experiments import (
    build_perception,
    build_task,
    comparator,
    ready_pose,
    run_scored_trial,
    supervisor_of,
    true_hole_m,
)
from palpate.adapters.mujoco import SimulatedRig

TURNED = {"tilt_heading": "drawn", "grip_trials": 1, "yaw_deg": 5.0, "plate_lean_mrad": 17.5}


@pytest.mark.parametrize(
    ("clearance_mm", "seed", "trial"),
    [
        pytest.param(0.02, 3, 26, id="pinched in the mouth of the hole, by 2.7 N where 2.45 N trip"),
        pytest.param(0.075, 90421, 184, id="wedged, and its height driven up while it is pushed"),
    ],
)
def test_a_square_that_something_holds_is_freed(clearance_mm: float, seed: int, trial: int) -> None:
    peg = {"cross_section": "square", "clearance_mm": clearance_mm}
    cell = {"tilt_mrad": 4.0, "hole_uncertainty_mm": 3.0, "conditions": TURNED, "peg": peg}
    own = {"corners": 4.0, "corner_mm": 20.5}
    config = overlay(overlay(scenario("paper"), task_kind("insertion-6dof").preset), {"seed": seed, "cell": cell})
    config = overlay(config, {"task": {"name": "insertion-6dof", "options": own}})
    ready = ready_pose(config)
    with SimulatedRig(config, ready) as rig:
        perception = build_perception(RunConfig(task=config.task))
        task = build_task(config, ready, perception, comparator("corner-first", config, lambda: true_hole_m(rig)))
        supervisor = supervisor_of(rig, config, ready)
        scored = run_scored_trial(config, rig, task, 500_000 + trial, first=500_000, supervisor=supervisor)
    assert scored.success
    assert scored.truth is not None
    assert scored.truth.peak_force_N < 20.0
