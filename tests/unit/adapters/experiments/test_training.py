"""Training can be ended at any time, and goes on as if it had not been."""

import signal
from dataclasses import replace

import pytest

from palpate.adapters.experiments import RunFolder, build_perception, interrupting, task_actions
from palpate.adapters.experiments.training import Checkpoint, Trainer, require_sound, resume_from
from palpate.adapters.mujoco.rig import SimulatedRig
from palpate.core.errors import ConfigurationError, DeviceError, OutputError
from palpate.core.policy import (
    QLearning,
    QParameters,
    RandomWalkPolicy,
    TemperatureSchedule,
)
from palpate.core.trial.report import Event, Outcome
from tests.unit.adapters.samples import QUICK, ready_pose, scored_trial

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


def trained(folder, trials, *, interrupt_at=0):
    """Train, or go on training where the folder's checkpoint stands."""
    perception = build_perception(QUICK)
    policy = CtrlC(perception.states, task_actions(QUICK), interrupt_at)
    first = 0
    with SimulatedRig(QUICK, ready_pose()) as rig:
        if (folder.path / "checkpoint.json").exists():
            checkpoint = Checkpoint.load(folder)
            resume_from(checkpoint, policy, rig)
            first = checkpoint.next_trial
            folder.truncate(first)
        trainer = Trainer(QUICK, folder, ready_pose(), rig, perception, policy, first)
        trainer.train(trials, lambda scored: None)
        trainer.checkpoint()
        trainer.save_policy()
    return trainer


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
    trainer = trained(folder, 3, interrupt_at=13)
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
    asked = []
    with interrupting(lambda: asked.append(1)):
        signal.raise_signal(signal.SIGINT)
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
    assert asked == [1]


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
        require_sound(rig, replace(scored, blamed="JR3"), first=3)
    with pytest.raises(DeviceError, match=r"\(JR3: late; fault of the arm: stop not seen\)"):
        require_sound(rig, replace(scored, blamed="JR3: late", stopped_by="fault of the arm: stop not seen"))
