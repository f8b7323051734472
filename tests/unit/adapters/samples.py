"""What several of these tests need: trials that were never run, and a quick simulated run."""

from dataclasses import replace
from functools import cache

from palpate.adapters.config.run import RunConfig
from palpate.adapters.experiments import (
    FIRST_EVALUATION_TRIAL,
    NOT_RECORDED,
    ScoredTrial,
    TrialRow,
    Trials,
    build_perception,
)
from palpate.core.policy import Observation
from palpate.core.ports.rig import GroundTruth
from palpate.core.trial import DecisionRecord, Outcome, TaskConfig, TrialReport, TrialSetup, find_ready_pose

QUICK = RunConfig(task=TaskConfig(time_limit_s=1.0))


@cache
def ready_pose():
    """The ready pose of the default arm and goal."""
    return find_ready_pose(RunConfig().arm, RunConfig().tool.geometry, RunConfig().task)


def scored_trial(index, *, success=True, decisions=2):
    """A trial with figures that tell it from others."""
    report = TrialReport(
        TrialSetup(index, 7, (0.001 * index, -0.002)),
        outcome=Outcome.INSERTED if success else Outcome.TIME_LIMIT,
        exploration_time_s=0.5 + index,
        actions=decisions,
        peak_force_N=5.5,
        ticks=300 + index,
        decisions=[
            DecisionRecord(100 + 14 * k, "x+ y0", "x+ y0", "-x", "learned", -1.0 if k else None)
            for k in range(decisions)
        ],
        temperature=5.0,
    )
    return ScoredTrial(
        report, GroundTruth((1e-4, -2e-4, 0.0), (1e-4, -2e-4, 0.01), 0.01, 6.25), success, report.exploration_time_s
    )


def trial_rows(*times_s, success=True):
    """Lines of ``trials.csv`` that differ in number and time only."""
    plain = TrialRow.of(scored_trial(0, success=success))
    return [replace(plain, trial=k, exploration_time_s=time) for k, time in enumerate(times_s)]


def run_policy(config, rig, policy, trials, recording=NOT_RECORDED, *, perception=None, name=""):
    """Run trials of a policy on an open rig; what they were."""
    first, rows = FIRST_EVALUATION_TRIAL, list[TrialRow]()
    perception = perception or build_perception(config)
    work = Trials(config, ready_pose(), rig, perception, policy, recording, name=name, first=first)
    work.run_all(range(first, first + trials), lambda scored: rows.append(TrialRow.of(scored, first)))
    return rows


def observation(x_m=0.0, y_m=0.0, *, torque_Nm=(0.0, 0.0, 0.0), action_number=0):
    """What a policy sees with the tip commanded to (x, y)."""
    # The measured tip lies elsewhere, so that who confuses the two is found out.
    return Observation(0, (9.0, 9.0, 9.0), (x_m, y_m, 0.0), (0.0, 0.0, -5.0), torque_Nm, action_number)
