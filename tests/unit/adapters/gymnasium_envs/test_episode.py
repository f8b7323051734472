"""Trials decision by decision, begun again after an error, and a loop that waits for a slow agent."""

import pickle

import pytest

from palpate.adapters.config.run import RunConfig
from palpate.adapters.experiments import Run, build_perception, build_task, supervisor_of, task_actions, trial_setup
from palpate.adapters.gymnasium_envs import episode
from palpate.adapters.gymnasium_envs.agent import LATE, Agent, LateAgentError
from palpate.adapters.gymnasium_envs.episode import Episodes
from palpate.adapters.mujoco import SimulatedRig
from palpate.core.control_loop import LoopObserver, run_trial
from palpate.core.errors import DeviceError
from palpate.core.policy import Decision
from palpate.core.ports import CommandReason, JointCommand
from palpate.core.trial import Outcome, TaskConfig, find_ready_pose

EAST = Decision(task_actions(RunConfig())[0], 0, "test")


def simulated(config):
    return Episodes(Run(config))


@pytest.fixture
def episodes():
    made = simulated(RunConfig(task=TaskConfig(time_limit_s=0.5)))
    yield made
    made.close()


def stopped(episodes):
    here = episodes.rig.cell.joint_angles()
    return episodes.rig.ports.arm.send(JointCommand(here)).reason is CommandReason.STOPPED


def test_error_in_mid_trial_stops_the_arm_and_the_next_trial_begins(episodes, monkeypatch):
    episodes.begin(3, 0)
    with monkeypatch.context() as broken:
        broken.setattr(episodes.rig.cell, "measure_joints", lambda: 1 / 0)
        with pytest.raises(ZeroDivisionError):
            episodes.decide(EAST)
    assert not episodes.running
    assert stopped(episodes)
    episodes.begin(3, 0)
    assert episodes.decide(EAST) == -1.0


def test_sensor_fault_ends_the_trial_and_earns_the_plain_reinforcement(episodes, monkeypatch):
    episodes.begin(3, 0)
    with monkeypatch.context() as broken:
        # What the supervisor takes for a frozen sensor.
        same = episodes.rig.cell.measure_wrench()
        broken.setattr(episodes.rig.cell, "measure_wrench", lambda: same)
        earned = 0.0
        while episodes.running:
            earned = episodes.decide(EAST)
    assert episodes.outcome in (Outcome.TRIPPED, Outcome.SENSOR_FAULT)
    assert episodes.report.decisions[-1].reinforcement is None
    assert earned == episodes.plain_reinforcement == -1.0


def test_trials_without_any_decision_are_not_searched_for_ever(monkeypatch):
    monkeypatch.setattr(episode, "MOST_SKIPPED", 4)
    made = simulated(RunConfig(task=TaskConfig(start_uncertainty_mm=0.0)))
    with pytest.raises(DeviceError, match="work cell: 4 trials without any decision: inserted"):
        made.begin(0, 0)
    assert not made.running
    made.close()


CONFIG = RunConfig(task=TaskConfig(time_limit_s=1.0))
MS = 1_000_000


class SlowAgent(LoopObserver):
    """Answers so many ms after it was shown something."""

    def __init__(self, desk, think_ms):
        self._desk, self._think_ns = desk, think_ms * MS
        self._shown_ns = None
        self._now_ns = 0
        self.shown = 0
        desk.look = self._look

    def _look(self):
        self._shown_ns, self.shown = self._now_ns, self.shown + 1
        if not self._think_ns:
            self._answer()

    def clock_read(self, deadline_ns, time_ns):
        self._now_ns = time_ns
        if self._shown_ns is not None and time_ns - self._shown_ns >= self._think_ns:
            self._answer()

    def _answer(self):
        self._shown_ns = None
        self._desk.give(Decision(task_actions(CONFIG)[0], 0, "agent"))


class Bench:
    """A simulated cell with an agent at the desk."""

    def __init__(self, rig, think_ms):
        self.rig, self.desk = rig, Agent(0.3, grace_s=0.0)
        self.agent = SlowAgent(self.desk, think_ms)
        ready = find_ready_pose(CONFIG.arm, CONFIG.tool.geometry, CONFIG.task)
        self.task = build_task(CONFIG, ready, build_perception(CONFIG), self.desk)
        rig.prepare(0)
        self._supervisor = supervisor_of(rig, CONFIG, ready)

    def run(self):
        observers = (self.agent, self.desk)
        return run_trial(self.task, self.rig.ports, trial_setup(CONFIG, 0), self._supervisor, observers)


@pytest.fixture
def rig():
    with SimulatedRig(CONFIG, find_ready_pose(CONFIG.arm, CONFIG.tool.geometry, CONFIG.task)) as made:
        yield made


@pytest.mark.parametrize(("think_ms", "sources"), [(0, ["agent"] * 3), (150, [LATE, LATE, "agent", LATE, LATE])])
def test_loop_goes_on_and_counts_what_was_late(rig, think_ms, sources):
    bench = Bench(rig, think_ms)
    report = bench.run()
    message = [record.source for record in report.decisions]
    assert message[: len(sources)] == sources
    assert bench.desk.late_decisions == message.count(LATE)
    # While it rests it goes on pressing, as hard as ever and no harder.
    assert report.outcome is Outcome.TIME_LIMIT
    assert report.peak_force_N < 10.0
    assert {record.displacement_m for record in report.decisions if record.source == LATE} <= {(0.0, 0.0)}


def test_agent_that_takes_too_long_finds_the_arm_stopped_and_the_rig_latched(rig):
    bench = Bench(rig, 400)
    with pytest.raises(LateAgentError, match=r"agent: no decision for 0\.30\d s; 0\.3 s are allowed") as caught:
        bench.run()
    here = rig.cell.joint_angles()
    assert rig.ports.arm.send(JointCommand(here)).reason is CommandReason.STOPPED
    assert rig.latch.cause == str(caught.value)
    assert bench.agent.shown == 1
    again = pickle.loads(pickle.dumps(caught.value))
    assert (type(again), str(again)) == (LateAgentError, str(caught.value))
    assert isinstance(again, DeviceError)
