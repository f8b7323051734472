"""Runs trials one after the other and scores them against the truth."""

from __future__ import annotations

from dataclasses import dataclass
from math import dist

from palpate.adapters.composition import SimulatedRig
from palpate.adapters.config import RunConfig
from palpate.core.cycle import run_trial
from palpate.core.errors import DeviceError
from palpate.core.insertion import InsertionTask
from palpate.core.randomness import Purpose, generator
from palpate.core.task_frame import draw_in_disc
from palpate.core.trial import Outcome, TrialReport, TrialSetup
from palpate.simulation.cell import Truth

FULL_DEPTH_TOLERANCE_M = 5e-5
"""A peg within this of the depth asked for is at full depth."""
_BESIDE_M = 1e-3


@dataclass(frozen=True)
class ScoredTrial:
    """A trial as the core saw it, and as it was.

    Attributes:
        report: The core's own account, from port data.
        truth: What really happened.
        success: Inserted to full depth, in the hole and not beside the plate, the true peak force below the limit.
    """

    report: TrialReport
    truth: Truth
    success: bool


def trial_setup(config: RunConfig, trial: int) -> TrialSetup:
    """The setup of a trial; it depends on the run's seed and the trial's index alone."""
    start = draw_in_disc(
        generator(config.seed, Purpose.START, trial),
        config.task.start_uncertainty_mm * 1e-3,
        config.task.start_shape,
    )
    return TrialSetup(trial, config.seed, start)


def run_scored_trial(config: RunConfig, rig: SimulatedRig, task: InsertionTask, trial: int) -> ScoredTrial:
    """Prepare the world, run one trial over the ports, and score it."""
    rig.prepare(trial)
    report = run_trial(task, rig.ports, trial_setup(config, trial))
    truth = rig.truth()
    success = (
        report.outcome is Outcome.INSERTED
        and dist(truth.tip_in_task_m[:2], truth.hole_in_task_m[:2]) < _BESIDE_M + config.cell.peg.clearance_mm * 1e-3
        and truth.depth_m >= config.task.insertion_depth_mm * 1e-3 - FULL_DEPTH_TOLERANCE_M
        and truth.peak_force_N < config.task.max_force_N
    )
    return ScoredTrial(report, truth, success)


def require_sound(scored: ScoredTrial) -> None:
    """Refuse to go on after a trial whose data cannot be trusted.

    Raises:
        DeviceError: A sensor failed, or the arm was stopped.
    """
    if scored.report.outcome in (Outcome.SENSOR_FAULT, Outcome.STOPPED):
        raise DeviceError("rig", f"trial {scored.report.setup.index}: {scored.report.events[-1].detail}")
