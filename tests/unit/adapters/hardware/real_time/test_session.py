"""A trial that is kept in time, and what becomes of one that was not."""

import json
from dataclasses import replace

import pytest

from palpate.adapters.config import AcceptanceConfig, RealTimeConfig, RunConfig
from palpate.adapters.experiments import trials
from palpate.adapters.experiments.build import build_perception, build_task, supervisor_of
from palpate.adapters.experiments.policies import baseline, learning_policy
from palpate.adapters.experiments.results import RunFolder
from palpate.adapters.experiments.training import Trainer
from palpate.adapters.experiments.trial import objections, run_scored_trial
from palpate.adapters.hardware.real_time.session import RealTimeSession
from palpate.adapters.mujoco.rig import SimulatedRig
from palpate.core.policy import learner_of
from palpate.core.trial.report import TrialReport, TrialSetup, TrialTiming
from tests.unit.adapters.samples import QUICK, ready_pose


def test_timing_does_not_change_a_trial_and_is_reported():
    config = RunConfig()

    def trial(session):
        with SimulatedRig(config, ready_pose()) as rig:
            policy = baseline("torque", config, tuple)
            task = build_task(config, ready_pose(), build_perception(config), policy)
            return run_scored_trial(
                config, rig, task, 0, supervisor=supervisor_of(rig, config, ready_pose()), session=session
            )

    with RealTimeSession(RealTimeConfig()) as session:
        timed = trial(session)
        message, logged = session.report(), json.loads(session.report_json())
    assert timed == trial(None)
    for section in ("clock", "force", "joints", "perceive", "decide", "control", "supervise", "send", "record"):
        assert f"{section} " in message
        assert logged["longest_ns"][section] > 0
    assert logged["ticks"] == timed.report.ticks
    # Time waits for the loop.
    assert logged["late_ms"]["max"] == 0.0


@pytest.mark.parametrize(
    ("timing", "why"),
    [
        (TrialTiming(), ""),
        (TrialTiming(worst_late_ns=21_000_000), "a tick too late (21.0 ms)"),
        (TrialTiming(repeated_samples=950), "too few new samples (95% of the ticks had none)"),
        (TrialTiming(late_ticks=60, skipped_slots=30), "too many late ticks (6%); slots skipped (30)"),
    ],
)
def test_timing_that_does_not_count_is_named(timing, why):
    report = TrialReport(TrialSetup(0, 1, (0.0, 0.0)), ticks=1000, timing=timing)
    assert objections(report, AcceptanceConfig()) == why


@pytest.mark.parametrize("learn", [False, True])
def test_nothing_is_learned_from_a_marked_trial(learn, tmp_path, monkeypatch):
    def late(*words, **named):
        return replace(run_scored_trial(*words, **named), flagged="late")

    monkeypatch.setattr(trials, "run_scored_trial", late)
    config = replace(QUICK, acceptance=AcceptanceConfig(learn_from_flagged=learn))
    perception = build_perception(config)
    policy = learning_policy(config, perception)
    learner = learner_of(policy)
    before = learner.get_state()
    with SimulatedRig(config, ready_pose()) as rig:
        trainer = Trainer(config, RunFolder(tmp_path), ready_pose(), rig, perception, policy)
        trainer.train(1, lambda scored: None)
    assert (learner.get_state() != before) is learn
    assert "late" in (tmp_path / "trials.csv").read_text()
