"""Insertions in six degrees of freedom as tests and benchmarks run them, with drawn poses of hole, plate and grip."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from palpate.adapters.config import RunConfig, overlay, scenario, task_kind
from palpate.adapters.experiments import (
    build_task,
    comparator,
    plain_perception,
    ready_pose,
    run_scored_trial,
    supervisor_of,
    true_hole_m,
)
from palpate.adapters.mujoco import SimulatedRig
from palpate.core.errors import DeviceError

TASK = "insertion-6dof"
FIRST = 500_000
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


_PRESET: Mapping[str, Any] = {"task": {"area_half_width_mm": 11.0, "depth_tolerance_mm": 0.5}}
"""What the job derives for these pegs."""


def world_of(shape: str) -> Mapping[str, Any]:
    """The world that is asked: a round peg in a grip that leans, others in a hole that is turned, too."""
    if shape == "round":
        return {"cell": GRIP, "task": {"area_half_width_mm": 3.5}}
    turned = {**GRIP["conditions"], "yaw_deg": 5.0, "plate_lean_mrad": 17.5}
    return {"cell": {**GRIP, "hole_uncertainty_mm": 3.0, "conditions": turned, "peg": {"cross_section": shape}}}


def config_of(shape: str, conditions: str, arm: str, options: Mapping[str, Any]) -> RunConfig:
    corners, corner_mm = CORNERS[shape]
    config = overlay(overlay(scenario("paper"), task_kind(TASK).preset), {"arm": arm, "task": {"name": TASK}})
    config = overlay(overlay(overlay(config, _PRESET), world_of(shape)), CONDITIONS[conditions])
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
