"""Trials decision by decision: left in the middle, begun again, and after an error."""

import pytest

from palpate.adapters.config.run import RunConfig
from palpate.adapters.experiments import Run, task_actions
from palpate.adapters.gymnasium_envs import episode
from palpate.adapters.gymnasium_envs.episode import Episodes, NotRunningError
from palpate.core.errors import DeviceError
from palpate.core.policy import Decision
from palpate.core.ports.values import CommandReason, JointCommand
from palpate.core.trial import Outcome, TaskConfig

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


def test_at_its_end_the_arm_is_stopped_and_nothing_can_be_decided(episodes):
    episodes.begin(3, 0)
    while episodes.running:
        assert not stopped(episodes)
        assert episodes.decide(EAST) == -1.0
    assert episodes.outcome is Outcome.TIME_LIMIT
    assert stopped(episodes)
    with pytest.raises(NotRunningError):
        episodes.decide(EAST)


def test_an_error_in_mid_trial_stops_the_arm_and_the_next_trial_begins(episodes, monkeypatch):
    episodes.begin(3, 0)
    with monkeypatch.context() as broken:
        broken.setattr(episodes.rig.cell, "measure_joints", lambda: 1 / 0)
        with pytest.raises(ZeroDivisionError):
            episodes.decide(EAST)
    assert not episodes.running
    assert stopped(episodes)
    episodes.begin(3, 0)
    assert episodes.decide(EAST) == -1.0


def test_a_sensor_fault_ends_the_trial_and_earns_the_plain_reinforcement(episodes, monkeypatch):
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
