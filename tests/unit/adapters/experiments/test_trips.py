"""In the simulator a trip is a result: a failure at the time limit's cost, after which the next trial begins."""

import json
from dataclasses import replace

import pytest

from palpate.adapters.experiments import (
    RunFolder,
    ScoredTrial,
    Trainer,
    baseline,
    build_perception,
    task_actions,
)
from palpate.adapters.experiments.training import Checkpoint, resume_from
from palpate.adapters.mujoco import SimulatedRig
from palpate.core.errors import DeviceError
from palpate.core.policy import QLearning, QParameters, TemperatureSchedule
from palpate.core.trial import Outcome
from tests.support.faults import FaultPlan, faulty
from tests.unit.adapters.samples import QUICK, ready_pose, run_policy

STRICT = replace(QUICK, supervision=replace(QUICK.supervision, max_force_N=5.5))
"""Some trials press harder than this while they explore; the task itself would not mind."""


def learner(config):
    parameters = QParameters(alpha=0.3, gamma=1.0, temperature=TemperatureSchedule(5.0, 0.96, 0.3))
    return QLearning(build_perception(config).states, task_actions(config), parameters)


def trained(
    path,
    trials,
    policy,
    config=STRICT,
    breaking=lambda ports: ports,
):
    """Train, or resume from the folder's checkpoint."""
    folder, done = RunFolder(path), list[ScoredTrial]()
    with SimulatedRig(config, ready_pose()) as rig:
        rig.ports, first = breaking(rig.ports), 0
        if path.exists():
            checkpoint = Checkpoint.load(folder)
            resume_from(checkpoint, policy, rig)
            first = checkpoint.next_trial
        else:
            folder.create()
        trainer = Trainer(config, folder, ready_pose(), rig, build_perception(config), policy, first)
        trainer.train(trials, done.append)
    return done


def test_on_a_rig_of_devices_the_same_trip_ends_the_run():
    walk = baseline("random", STRICT, lambda: (0.0, 0.0))
    with SimulatedRig(STRICT, ready_pose()) as rig:
        rig.simulated = False
        with pytest.raises(DeviceError, match=r"trial \d: FORCE_LIMIT: force \d\.\d+ N, limit 5\.5 N"):
            run_policy(STRICT, rig, walk, 4)
        assert rig.latch.cause.startswith("FORCE_LIMIT: ")


def test_training_resumes_across_trips_as_if_it_had_not_been_interrupted(tmp_path):
    policies = learner(STRICT), learner(STRICT), learner(STRICT)
    done = trained(tmp_path / "whole", 4, policies[0])
    assert any(scored.trip for scored in done[:3])
    for trials, policy in zip((2, 4), policies[1:], strict=True):
        trained(tmp_path / "parts", trials, policy)
    for name in ("trials.csv", "decisions.csv", "checkpoint.json"):
        assert (tmp_path / "whole" / name).read_bytes() == (tmp_path / "parts" / name).read_bytes()


def test_an_exceeded_limit_costs_the_last_action_the_rest_of_the_time_limit(tmp_path):
    config = replace(STRICT, task=replace(STRICT.task, time_limit_s=20.0))
    policy = learner(config)
    (scored,) = trained(tmp_path / "run", 1, policy, config)
    report = scored.report
    assert report.trip is not None
    assert report.outcome is Outcome.TRIPPED
    last = report.decisions[-1]
    assert last.index is not None
    # Ten actions a second, each at a cost of one, of which alpha is learned.
    left = int((20.0 - report.exploration_time_s) * 10)
    assert policy.q[policy.states.index(last.state)][last.index] == pytest.approx(-0.3 * left, abs=2.0)


def test_nothing_is_learned_from_a_trial_with_a_sensor_fault(tmp_path):
    policy = learner(QUICK)
    before = policy.get_state()
    frozen = FaultPlan("freeze", "force_sensor", 150)
    (scored,) = trained(tmp_path / "run", 1, policy, QUICK, lambda ports: faulty(ports, (frozen,)))
    assert scored.trip
    assert len(scored.report.decisions) > 1
    assert json.dumps(policy.get_state()) == json.dumps(before)


@pytest.mark.parametrize(("stopped_by", "latched"), [("key: a key was pressed", True), ("", False)])
def test_on_a_rig_a_person_s_stop_is_a_fault_and_the_program_s_own_is_not(monkeypatch, stopped_by, latched):
    walk = baseline("random", QUICK, lambda: (0.0, 0.0))
    with SimulatedRig(QUICK, ready_pose()) as rig:
        rig.simulated = False
        monkeypatch.setattr(rig, "stopped_by", lambda: stopped_by)
        send, sent = rig.ports.arm.send, list[int]()

        def stop_in_the_middle(command):
            sent.append(1)
            if len(sent) == 100:
                rig.ports.arm.stop()
            return send(command)

        monkeypatch.setattr(rig.ports.arm, "send", stop_in_the_middle)
        with pytest.raises(DeviceError, match="trial 0: stopped from outside"):
            run_policy(QUICK, rig, walk, 1)
        assert bool(rig.latch.cause) is latched
