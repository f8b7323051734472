"""Trials decision by decision: left in the middle, begun again, and after an error."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from palpate.adapters.config.run import PerceptionConfig, RunConfig
from palpate.adapters.experiments.build import task_actions
from palpate.adapters.gymnasium_envs.episode import InsertionEpisodes, NotRunningError
from palpate.core.errors import DeviceError
from palpate.core.insertion.config import TaskConfig
from palpate.core.insertion.trial import Outcome, Phase
from palpate.core.policy import Decision
from palpate.core.ports.values import CommandReason, JointCommand

EAST = Decision(task_actions(RunConfig())[0], 0, "test")


@pytest.fixture
def episodes() -> Iterator[InsertionEpisodes]:
    made = InsertionEpisodes(RunConfig(task=TaskConfig(time_limit_s=0.5)))
    yield made
    made.close()


def stopped(episodes: InsertionEpisodes) -> bool:
    here = episodes.rig.cell.joint_angles()
    return episodes.rig.ports.arm.send(JointCommand(here)).reason is CommandReason.STOPPED


def test_a_trial_waits_in_the_middle_of_the_tick_of_its_first_choice(episodes: InsertionEpisodes) -> None:
    episodes.begin(3, 0)
    assert episodes.running
    assert episodes.task.phase is Phase.EXPLORE
    assert episodes.report.decisions == []
    assert episodes.exploration_time_s == pytest.approx(0.1)
    assert episodes.decisions_left == 4


def test_at_its_end_the_arm_is_stopped_and_nothing_can_be_decided(episodes: InsertionEpisodes) -> None:
    episodes.begin(3, 0)
    while episodes.running:
        assert not stopped(episodes)
        assert episodes.decide(EAST) == -1.0
    assert episodes.outcome is Outcome.TIME_LIMIT
    assert stopped(episodes)
    with pytest.raises(NotRunningError):
        episodes.decide(EAST)


def test_a_trial_that_is_left_in_its_middle_leaves_no_trace(episodes: InsertionEpisodes) -> None:
    episodes.begin(3, 1)
    expected = [episodes.decide(EAST), episodes.task.tip_m, episodes.task.wrench_at_tip, episodes.report.ticks]
    episodes.begin(4, 7)
    episodes.begin(3, 1)
    again = [episodes.decide(EAST), episodes.task.tip_m, episodes.task.wrench_at_tip, episodes.report.ticks]
    assert again == expected


def test_an_error_in_mid_trial_stops_the_arm_and_the_next_trial_begins(
    episodes: InsertionEpisodes, monkeypatch: pytest.MonkeyPatch
) -> None:
    episodes.begin(3, 0)
    with monkeypatch.context() as broken:
        broken.setattr(episodes.rig.cell, "measure_joints", lambda: 1 / 0)
        with pytest.raises(ZeroDivisionError):
            episodes.decide(EAST)
    assert not episodes.running
    assert stopped(episodes)
    episodes.begin(3, 0)
    assert episodes.decide(EAST) == -1.0


def test_a_sensor_fault_ends_the_trial_and_earns_the_plain_reinforcement(
    episodes: InsertionEpisodes, monkeypatch: pytest.MonkeyPatch
) -> None:
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


def test_the_perception_may_have_to_be_fitted_first() -> None:
    fitted = PerceptionConfig(symbols="clusters", symbol_count=5, fit_trials=1)
    made = InsertionEpisodes(RunConfig(task=TaskConfig(time_limit_s=1.0), perception=fitted))
    made.begin(2, 0)
    assert len(made.perception.states) == 5
    assert made.decide(EAST) == -1.0
    made.close()


def test_trials_without_any_decision_are_not_searched_for_ever() -> None:
    made = InsertionEpisodes(RunConfig(task=TaskConfig(start_uncertainty_mm=0.0)))
    with pytest.raises(DeviceError, match="work cell: 20 trials without any decision: inserted"):
        made.begin(0, 0)
    assert not made.running
    made.close()
