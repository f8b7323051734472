"""Training can be ended at any time and resumes as if it had not been; what a trip costs it."""

import json
import signal
from dataclasses import replace

import pytest

from palpate.adapters.experiments import RunFolder, Trainer, baseline, build_perception, interrupting, task_actions
from palpate.adapters.experiments.training import Checkpoint, require_sound, resume_from
from palpate.adapters.mujoco import SimulatedRig
from palpate.core.errors import ConfigurationError, DeviceError, OutputError
from palpate.core.policy import QLearning, QParameters, RandomWalkPolicy, TemperatureSchedule
from palpate.core.trial import Outcome
from palpate.core.trial.report import Event
from tests.support.faults import FaultPlan, faulty
from tests.unit.adapters.samples import QUICK, ready_pose, run_policy, scored_trial

FILES = ("trials.csv", "decisions.csv", "checkpoint.json", "policy.json")


class CtrlC(QLearning):
    """A learner whose operator presses Ctrl-C at a certain choice, the first being 1."""

    def __init__(self, states, actions, at_choice):
        schedule = TemperatureSchedule(5.0, 0.96, 0.3)
        super().__init__(states, actions, QParameters(alpha=0.3, gamma=1.0, temperature=schedule))
        self.at_choice, self.choices = at_choice, 0

    def choose(self, observation):
        self.choices += 1
        if self.choices == self.at_choice:
            signal.raise_signal(signal.SIGINT)
        return super().choose(observation)


def learner(config=QUICK, interrupt_at=0):
    return CtrlC(build_perception(config).states, task_actions(config), interrupt_at)


def trained(folder, trials, policy=None, config=QUICK, breaking=lambda ports: ports):
    """Train, or resume from the folder's checkpoint; the trainer and its trials."""
    policy, first, done = policy or learner(config), 0, []
    with SimulatedRig(config, ready_pose()) as rig:
        rig.ports = breaking(rig.ports)
        if (folder.path / "checkpoint.json").exists():
            checkpoint = Checkpoint.load(folder)
            resume_from(checkpoint, policy, rig)
            first = checkpoint.next_trial
            folder.truncate(first)
        trainer = Trainer(config, folder, ready_pose(), rig, build_perception(config), policy, first)
        trainer.train(trials, done.append)
        trainer.checkpoint()
        trainer.save_policy()
    return trainer, done


def content(folder):
    return {name: (folder.path / name).read_bytes() for name in FILES}


def folder_in(path, name):
    folder = RunFolder(path / name)
    folder.create()
    return folder


@pytest.fixture(scope="module")
def straight(tmp_path_factory):
    """What uninterrupted runs of one and of three trials leave."""
    path = tmp_path_factory.mktemp("straight")
    contents = {}
    for trials in (1, 3):
        folder = folder_in(path, str(trials))
        trained(folder, trials)
        contents[trials] = content(folder)
    return contents


def test_an_interrupted_trial_leaves_no_trace(tmp_path, straight):
    folder = folder_in(tmp_path, "run")
    # A quick trial has some nine choices: this one falls into the second.
    trainer, _ = trained(folder, 3, learner(interrupt_at=13))
    assert trainer.interrupted
    assert trainer.next_trial == 1
    assert content(folder) == straight[1]
    trained(folder, 3)
    assert content(folder) == straight[3]


def test_a_run_that_was_killed_between_two_files_goes_on_as_if_it_had_not(tmp_path, straight):
    folder = folder_in(tmp_path, "run")
    trained(folder, 1)
    # The trial after the checkpoint had been written in part.
    with (folder.path / "trials.csv").open("a") as stream:
        stream.write("1,inserted,True,9.9,1,1.0,1.0,10.0,0.0,0.0,0.0,0.0,300,5.0,,\n")
    with (folder.path / "decisions.csv").open("a") as stream:
        stream.write("1,136,x+ y0,x+ y0,+x,learned,-1.0,5.0\n1,150,x+")
    trained(folder, 3)
    assert content(folder) == straight[3]


def test_a_policy_without_a_learner_cannot_be_trained(tmp_path):
    perception = build_perception(QUICK)
    walk = RandomWalkPolicy(task_actions(QUICK))
    with SimulatedRig(QUICK, ready_pose()) as rig, pytest.raises(ConfigurationError, match="a learner"):
        Trainer(QUICK, folder_in(tmp_path, "run"), ready_pose(), rig, perception, walk)


def test_the_second_ctrl_c_does_not_wait():
    requested = []
    with interrupting(lambda: requested.append(1)):
        signal.raise_signal(signal.SIGINT)
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
    assert requested == [1]


@pytest.mark.parametrize("text", [None, "", "[]", "{}", '{"next_trial": 1}'])
def test_a_damaged_checkpoint_is_refused(tmp_path, text):
    folder = folder_in(tmp_path, "run")
    if text is not None:
        (folder.path / "checkpoint.json").write_text(text)
    with pytest.raises(OutputError, match=r"checkpoint\.json"):
        Checkpoint.load(folder)


def test_on_a_rig_a_trial_with_untrustworthy_data_ends_the_run():
    scored, rig = scored_trial(4), SimulatedRig(QUICK, ready_pose())
    rig.simulated = False
    require_sound(rig, scored)
    scored.report.outcome = Outcome.SENSOR_FAULT
    scored.report.events.append(Event(7, "end", "sensor fault: force sample stale"))
    with pytest.raises(DeviceError, match=r"trial 1: sensor fault: force sample stale$"):
        require_sound(rig, scored, first=3)
    with pytest.raises(DeviceError, match=r"force sample stale \(JR3\)$"):
        require_sound(rig, replace(scored, trip_source="JR3"), first=3)
    with pytest.raises(DeviceError, match=r"\(JR3: late; fault of the arm: stop not seen\)"):
        require_sound(rig, replace(scored, trip_source="JR3: late", stopped_by="fault of the arm: stop not seen"))


STRICT = replace(QUICK, supervision=replace(QUICK.supervision, max_force_N=5.5))
"""Some trials press harder than this while they explore; the task itself would not mind."""


def test_training_resumes_across_trips_as_if_it_had_not_been_interrupted(tmp_path):
    whole, parts = folder_in(tmp_path, "whole"), folder_in(tmp_path, "parts")
    _, done = trained(whole, 4, config=STRICT)
    assert any(scored.trip for scored in done[:3])
    for trials in (2, 4):
        trained(parts, trials, config=STRICT)
    assert content(whole) == content(parts)


def test_an_exceeded_limit_costs_the_last_action_the_rest_of_the_time_limit(tmp_path):
    config = replace(STRICT, task=replace(STRICT.task, time_limit_s=20.0))
    policy = learner(config)
    _, (scored,) = trained(folder_in(tmp_path, "run"), 1, policy, config)
    report = scored.report
    assert report.trip is not None
    assert report.outcome is Outcome.TRIPPED
    last = report.decisions[-1]
    # Ten actions a second, each at a cost of one, of which alpha is learned.
    left = int((20.0 - report.exploration_time_s) * 10)
    assert policy.q[policy.states.index(last.state)][last.index] == pytest.approx(-0.3 * left, abs=2.0)


def test_nothing_is_learned_from_a_trial_with_a_sensor_fault(tmp_path):
    policy = learner(QUICK)
    before = policy.get_state()
    frozen = FaultPlan("freeze", "force_sensor", 150)
    _, (scored,) = trained(folder_in(tmp_path, "run"), 1, policy, QUICK, lambda ports: faulty(ports, (frozen,)))
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
