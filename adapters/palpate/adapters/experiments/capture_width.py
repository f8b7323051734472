"""Capture width: how far beside the hole the peg may pass and still drop in. Search times mean nothing without it."""

from dataclasses import replace
from math import cos, pi, sin

from palpate.adapters.config import PerceptionConfig, RunConfig
from palpate.adapters.experiments.build import build_insertion, build_perception
from palpate.adapters.experiments.comparators import StraightPass
from palpate.adapters.mujoco import SimulatedRig
from palpate.core.control_loop import run_trial
from palpate.core.tasks.insertion import InsertionTask
from palpate.core.trial import ReadyPose, TrialSetup
from palpate.simulation.work_cell import ConditionsConfig

_APPROACH_M = 2e-3
_PAST_M = 4e-3


def capture_half_width_m(
    config: RunConfig,
    ready: ReadyPose,
    *,
    speed_m_s: float = 0.005,
    headings: int = 4,
    precision_m: float = 1e-5,
) -> float:
    """Largest distance from the hole's centre at which a pass still ends in the hole, averaged over headings.

    The peg is put down 2 mm before the hole and moves straight past it, with the core's own
    control, over the same ports; the distance of the pass is found by bisection. Sensor noise is off.

    Args:
        speed_m_s: Mean speed of the pass: each action moves for four fifths of its time.
    """
    sensor = replace(config.cell.sensor, force_noise_N=0.0, torque_noise_Nm=0.0)
    cell = replace(config.cell, sensor=sensor, hole_uncertainty_mm=0.0, conditions=ConditionsConfig())
    action_s = config.task.ticks_per_action / 140
    task_config = replace(
        config.task,
        start_uncertainty_mm=0.0,
        area_half_width_mm=10.0,
        time_limit_s=(_APPROACH_M + _PAST_M) / speed_m_s + 2 * action_s,
    )
    signal = replace(
        PerceptionConfig(),
        cutoff_Hz=config.perception.cutoff_Hz,
        filter_order=config.perception.filter_order,
        calibration=config.perception.calibration,
    )
    config = RunConfig(arm=config.arm, task=task_config, cell=cell, perception=signal, control=config.control)
    policy = StraightPass(speed_m_s * action_s)
    task = build_insertion(config, ready, build_perception(config), policy)
    total = 0.0
    with SimulatedRig(config, ready) as rig:
        for k in range(headings):
            policy.heading_rad = 2 * pi * (k + 0.25) / headings
            total += _widest_pass(rig, task, policy.heading_rad, precision_m)
    return total / headings


def _widest_pass(rig: SimulatedRig, task: InsertionTask, heading_rad: float, precision_m: float) -> float:
    c, s = cos(heading_rad), sin(heading_rad)
    caught, missed = 0.0, 2e-3
    while missed - caught > precision_m:
        miss = (caught + missed) / 2
        rig.prepare(0)
        start = (-_APPROACH_M * c - miss * s, -_APPROACH_M * s + miss * c)
        run_trial(task, rig.ports, TrialSetup(0, 0, start))
        caught, missed = (miss, missed) if rig.truth().depth_m > 1e-3 else (caught, miss)
    return caught
