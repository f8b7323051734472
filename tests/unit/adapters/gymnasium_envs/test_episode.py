"""Trials decision by decision: left in the middle, begun again, and after an error."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from palpate.adapters.config.compose import scenario
from palpate.adapters.config.run import PerceptionConfig, RunConfig
from palpate.adapters.experiments import run_toml, task_actions
from palpate.adapters.gymnasium_envs import episode
from palpate.adapters.gymnasium_envs.episode import (
    GivenActions,
    InsertionEpisodes,
    NotRunningError,
    run_config,
)
from palpate.core.errors import DeviceError, LifecycleError
from palpate.core.policy import Decision, Observation, Policy, Transition
from palpate.core.ports.values import CommandReason, JointCommand
from palpate.core.trial import Outcome, TaskConfig

EAST = Decision(task_actions(RunConfig())[0], 0, "test")


@pytest.fixture
def episodes() -> Iterator[InsertionEpisodes]:
    made = InsertionEpisodes(RunConfig(task=TaskConfig(time_limit_s=0.5)))
    yield made
    made.close()


def stopped(episodes: InsertionEpisodes) -> bool:
    here = episodes.rig.cell.joint_angles()
    return episodes.rig.ports.arm.send(JointCommand(here)).reason is CommandReason.STOPPED


def test_at_its_end_the_arm_is_stopped_and_nothing_can_be_decided(episodes: InsertionEpisodes) -> None:
    episodes.begin(3, 0)
    while episodes.running:
        assert not stopped(episodes)
        assert episodes.decide(EAST) == -1.0
    assert episodes.outcome is Outcome.TIME_LIMIT
    assert stopped(episodes)
    with pytest.raises(NotRunningError):
        episodes.decide(EAST)


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


def test_trials_without_any_decision_are_not_searched_for_ever(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(episode, "MOST_SKIPPED", 4)
    made = InsertionEpisodes(RunConfig(task=TaskConfig(start_uncertainty_mm=0.0)))
    with pytest.raises(DeviceError, match="work cell: 4 trials without any decision: inserted"):
        made.begin(0, 0)
    assert not made.running
    made.close()


# Errors are ours and Gymnasium's, and survive the way from a worker process.


# The policy of an environment hands out what it was given, once.


NOWHERE = (0.0, 0.0, 0.0)
SEEN = Observation(0, NOWHERE, NOWHERE, NOWHERE, NOWHERE, 0)


def test_it_chooses_what_it_was_given_once_and_in_the_same_trial_only() -> None:
    policy = GivenActions()
    assert isinstance(policy, Policy)
    assert policy.temperature is None
    assert policy.serves(99)
    policy.give(EAST)
    assert policy.choose(SEEN) is EAST
    policy.learn(Transition(0, 0, -1.0, None))
    with pytest.raises(LifecycleError, match="none is given"):
        policy.choose(SEEN)
    policy.give(EAST)
    policy.begin_trial(1, np.random.default_rng(0))
    with pytest.raises(LifecycleError):
        policy.choose(SEEN)


# Keyword arguments become the configuration that a run would have.


def test_arguments_win_over_settings_and_settings_over_the_preset() -> None:
    table = {"scenario": "blind", "arm": "ur5", "cell": {"hole_uncertainty_mm": 1.5}}
    config = run_config("", "", table)
    assert (config.scenario, config.arm, config.cell.hole_uncertainty_mm) == ("blind", "ur5", 1.5)
    assert run_config("blind", "", None) == scenario("blind")
    assert run_config("paper", "zebra-zero", table).arm == "zebra-zero"
    assert table["scenario"] == "blind"  # the caller's own table is left as it is


def test_the_file_of_a_run_serves_as_settings(tmp_path: Path) -> None:
    config = run_config("blind", "ur5", {"task": {"time_limit_s": 7.0}, "seed": 3})
    path = tmp_path / "run.toml"
    path.write_text(run_toml(config, "train", trials=3), encoding="utf-8")
    assert run_config("", "", path) == run_config("", "", str(path)) == config
