"""What-if settings, and logs that do not say enough."""

import json
from dataclasses import replace
from pathlib import Path

import pytest

from palpate.adapters.config import overlay, to_toml
from palpate.adapters.log import TrialLog, config_of, read_log
from palpate.adapters.replay.rebuild import Changes, Rebuilder, changed_config, parse_setting
from palpate.core.errors import ConfigurationError, LogError, PalpateError

GOLDEN = Path(__file__).parents[3] / "golden"


@pytest.fixture
def log() -> TrialLog:
    return read_log(GOLDEN / "train-paper.mcap")


@pytest.mark.parametrize(
    ("setting", "table"),
    [
        ("task.max_force_N=20", {"task": {"max_force_N": 20}}),
        ("task.max_force_N = 2.5e1", {"task": {"max_force_N": 25.0}}),
        ("seed=7", {"seed": 7}),
        ("task.area_centre=start", {"task": {"area_centre": "start"}}),
        ('task.area_centre="start"', {"task": {"area_centre": "start"}}),
        ("perception.channels=['x', 'y']", {"perception": {"channels": ["x", "y"]}}),
        ("task.goal.x_mm=1", {"task": {"goal": {"x_mm": 1}}}),
    ],
)
def test_settings_as_they_are_written(setting: str, table: dict[str, object]) -> None:
    assert parse_setting(setting) == table


@pytest.mark.parametrize(
    "setting", ["", "=", "task", "task.=1", ".x=1", "cell.substeps=2", "recording.enabled=false", "arm=ur5"]
)
def test_settings_that_are_none(setting: str) -> None:
    with pytest.raises(ConfigurationError):
        parse_setting(setting)


def test_settings_lie_over_the_log_s_own_configuration(log: TrialLog) -> None:
    config = changed_config(log, Changes(settings=("task.press_kgf=0.4",)))
    assert config == replace(config_of(log), task=replace(config_of(log).task, press_kgf=0.4))


@pytest.mark.parametrize(("limit_N", "weakened"), [(20, ()), (35, ("max_force_N",))])
def test_a_limit_that_was_weak_may_be_set_stronger(log: TrialLog, limit_N: int, weakened: tuple[str, ...]) -> None:
    weak = overlay(config_of(log), {"supervision": {"max_force_N": 40.0, "weakened": ["max_force_N"]}})
    log.start = replace(log.start, config_toml=to_toml(weak))
    supervision = changed_config(log, Changes(settings=(f"supervision.max_force_N={limit_N}",))).supervision
    assert (supervision.max_force_N, supervision.weakened) == (limit_N, weakened)


def test_one_rebuilder_serves_many_logs(log: TrialLog) -> None:
    rebuilder = Rebuilder()
    first = rebuilder.rebuild(log)
    assert rebuilder.rebuild(log).task is first.task
    assert rebuilder.rebuild(read_log(GOLDEN / "torque-ur5.mcap")).task is not first.task


@pytest.mark.parametrize(
    "fields",
    [
        {"config_toml": "scenario = "},
        {"config_toml": "[task]\nsteps_of_another_version = 1\n"},
        {"config_toml": 'arm = "irb120"\n'},
        {"perception_json": "{}"},
        {"perception_json": "no json"},
        {"policy_json": "{}"},
        {"policy": "a policy of another version"},
        {"learner_json": "{}"},
        {"learner_json": json.dumps({"q": [], "visits": []})},
        {"tip_rotation": (1.0, 0.0)},
        {"start_m": (1.0,)},
        {"world_json": "not json"},
    ],
    ids=str,
)
def test_a_start_that_was_altered_is_told_not_raised_through(log: TrialLog, fields: dict[str, object]) -> None:
    log.start = replace(log.start, **fields)  # type: ignore[arg-type]
    with pytest.raises(PalpateError):
        Rebuilder().rebuild(log)


def test_omniscience_needs_to_know_the_hole() -> None:
    log = read_log(GOLDEN / "omniscient-blind.mcap")
    world = {name: each for name, each in json.loads(log.start.world_json).items() if name != "hole_in_task_m"}
    log.start = replace(log.start, world_json=json.dumps(world))
    policy = Rebuilder().rebuild(log).policy
    with pytest.raises(LogError, match="where the hole was"):
        policy._hole_m()  # type: ignore[attr-defined]
