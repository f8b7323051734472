"""Decisions for a loop in a thread of its own, over a simulated rig: its time runs as fast as it can."""

import csv
import gc
import os
import pickle
import signal
import threading
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest

from palpate.adapters.config import RunConfig, configured
from palpate.adapters.experiments import Run, task_actions
from palpate.adapters.gymnasium_envs.episode import Episodes, NotRunningError
from palpate.adapters.gymnasium_envs.peg_insertion import PegInsertionEnv
from palpate.adapters.log import read_log
from palpate.adapters.mujoco import SimulatedRig
from palpate.adapters.replay.engine import Verdict, replay
from palpate.adapters.replay.rebuild import Rebuilder
from palpate.core.errors import (
    ConfigurationError,
    LifecycleError,
    OutputError,
    UsageError,
)
from palpate.core.policy import Decision
from palpate.core.ports import CommandReason, JointCommand, Life
from palpate.core.trial import Outcome, TaskConfig
from tests.support.rig_files import zebra_rig

HERE = (0.0,) * 6
EAST = Decision(task_actions(RunConfig())[0], 0, "environment")


def on_rig(config, out):
    rig = zebra_rig(Path(f"{out}-rig.toml"))
    return Episodes(Run(config, rig=str(rig), make_rig=SimulatedRig), out, 60.0)


@pytest.fixture
def episodes(tmp_path, monkeypatch):
    monkeypatch.setattr("palpate.adapters.experiments.run.warm_up", lambda config, ready: None)
    config = RunConfig(task=TaskConfig(time_limit_s=2.0))
    made = on_rig(config, str(tmp_path / "run"))
    made.observe = lambda task: task.tip_m
    yield made
    made.close()


def stopped(episodes):
    arm = episodes.rig.ports.arm
    return arm.life is Life.CLOSED or arm.send(JointCommand(HERE)).reason is CommandReason.STOPPED


def test_trials_are_recorded_as_a_run_leaves_them_and_replay_equal(episodes):
    folder = episodes.folder.path
    episodes.begin(5, 3)
    while episodes.running:
        episodes.decide(EAST)
    seen, info = episodes.seen()
    assert len(seen) == 3
    assert (info["outcome"], info["trial"], info["seed"]) == (Outcome.TIME_LIMIT.value, 3, 5)
    assert info["decisions"] >= info["late_decisions"]
    assert stopped(episodes)
    with pytest.raises(NotRunningError):
        episodes.decide(EAST)
    episodes.close()
    assert {path.name for path in folder.iterdir()} >= {"run.toml", "trials.csv"}
    with (folder / "trials.csv").open(encoding="utf-8", newline="") as stream:
        assert [row["trial"] for row in csv.DictReader(stream)] == ["0"]
    for path in sorted((folder / "logs").iterdir()):
        replayed = replay(read_log(path), Rebuilder())
        assert replayed.verdict is Verdict.EQUAL
        assert replayed.recorded_decisions == "an external agent chose the actions"
    with pytest.raises(OutputError, match="already holds a run"):
        on_rig(RunConfig(), str(folder))


def test_skills_are_decided_once_earn_once_and_replay_equal(tmp_path, monkeypatch):
    monkeypatch.setattr("palpate.adapters.experiments.run.warm_up", lambda config, ready: None)
    table = {"learner": "options", "task": {"time_limit_s": 3.0, "options": {"corners": 4.0, "corner_mm": 20.5}}}
    config = configured(scenario="blind-square", settings=table, task="insertion-6dof")
    # A test's thread that a busy computer holds up is no late agent: no rest comes between the skills.
    monkeypatch.setattr("palpate.adapters.gymnasium_envs.episode.GRACE_S", 60.0)
    with closing(on_rig(config, str(tmp_path / "run"))) as made:
        made.observe = lambda task: task.turn_rad
        skills = {action.name: Decision(action, k, "environment") for k, action in enumerate(task_actions(config))}
        made.begin(3, 0)
        earned = [made.decide(skills[name]) for name in ("tilt 1", "push 1")]
        # Ten a second, from the first decision to the third; the tool is tilted over the corner.
        assert sum(earned) == pytest.approx(-10.0 * made.exploration_time_s, abs=2.0)
        assert np.degrees(np.hypot(*made.seen()[0][:2])) == pytest.approx(config.task.options["tilt_deg"], abs=0.1)
        while made.running:
            made.decide(skills["push 1"])
    (log,) = (tmp_path / "run" / "logs").iterdir()
    assert replay(read_log(log), Rebuilder()).verdict is Verdict.EQUAL


@pytest.mark.parametrize(
    ("number", "error"), [(signal.SIGINT, KeyboardInterrupt), (signal.SIGTERM, SystemExit), (signal.SIGHUP, SystemExit)]
)
def test_a_signal_while_a_step_is_waited_for_leaves_the_arm_stopped(episodes, monkeypatch, number, error):
    episodes.begin(5, 0)
    measure, came = episodes.rig.cell.measure_joints, threading.Event()

    def press():
        if not came.is_set():
            came.set()
            os.kill(os.getpid(), number)
        return measure()

    monkeypatch.setattr(episodes.rig.cell, "measure_joints", press)
    # What a signal raises within a callback of the garbage collector, as hypothesis has one, is lost.
    gc.disable()
    try:
        with pytest.raises(error):
            all(episodes.decide(EAST) for _ in range(100))
    finally:
        gc.enable()
    assert not episodes.running
    assert episodes.outcome is Outcome.STOPPED
    assert stopped(episodes)
    # The next one begins as if nothing had been; one that is left in its middle ends likewise.
    episodes.begin(5, 1)
    episodes.begin(5, 2)
    assert episodes.running
    episodes.close()
    episodes.close()
    assert signal.getsignal(signal.SIGTERM) is signal.SIG_DFL
    assert not threading.main_thread().daemon
    assert stopped(episodes)


def test_an_environment_that_is_let_go_stops_the_arm_and_can_be_neither_copied_nor_drawn(tmp_path, monkeypatch):
    monkeypatch.setattr(
        "palpate.adapters.experiments.run.open_rig",
        lambda config, ready, file, acknowledge, accept_kinematics: SimulatedRig(config, ready),
    )
    monkeypatch.setattr("palpate.adapters.experiments.run.warm_up", lambda config, ready: None)
    rig_file = str(zebra_rig(tmp_path / "rig.toml"))
    with pytest.raises(ConfigurationError, match="None on a rig"):
        PegInsertionEnv(rig=rig_file, render_mode="rgb_array")
    with pytest.raises(ConfigurationError, match="no such file; there are examples"):
        PegInsertionEnv(rig=rig_file)
    with pytest.raises(UsageError, match="needs a job with part and tool: give --job FILE"):
        PegInsertionEnv(rig=rig_file, config={"seed": 3})
    job = Path("examples/jobs/paper-peg.toml").resolve()
    env = PegInsertionEnv(rig=rig_file, job=job, out=str(tmp_path / "run"), decision_limit_s=60.0, observations="raw")
    seen, info = env.reset(seed=1)
    assert seen in env.observation_space
    assert "true_tip_m" not in info
    with pytest.raises(LifecycleError, match="make it in the process that drives the arm"):
        pickle.dumps(env)
    with pytest.raises(LifecycleError, match="only a simulated cell"):
        env.cell  # noqa: B018
    arm = env.rig.ports.arm
    del env
    assert arm.life is Life.CLOSED


def test_the_loop_s_own_thread_can_close_it_as_a_garbage_collector_does(episodes):
    episodes.observe = lambda task: episodes.close()
    episodes.begin(5, 0)
    with pytest.raises(LifecycleError):
        episodes.decide(EAST)
    assert stopped(episodes)
