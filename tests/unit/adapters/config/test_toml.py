"""Configurations to TOML and back, tables that are wrong, and kinds of task by name."""

from tomllib import loads

import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.adapters.config import RunConfig, overlay, require_corners, scenario, task_kind, with_options
from palpate.adapters.config.run import LearningConfig, PerceptionConfig
from palpate.adapters.config.toml import literal, to_toml
from palpate.core.errors import ConfigurationError
from palpate.core.motion import ArmDescription
from palpate.core.trial.config import GoalConfig, TaskConfig

CHANGED = RunConfig(
    scenario="blind",
    arm="ur5",
    seed=2**63 - 1,
    task=TaskConfig(goal=GoalConfig(x_mm=-1e-7), ticks_per_action=7),
    perception=PerceptionConfig(
        calibration=(1.0, -1.0, 1e-300, 2.5, 1e22, 0.1), symbols="random", channels=("fz", "tx")
    ),
    learning=LearningConfig(
        alpha_visits=12.5, programmed={"x- y0": "+x", 'odd "name"\\': "-x"}, examples="a folder/übung.csv"
    ),
)

OWN = ArmDescription("/a.urdf", "tool", (0.0,) * 7, lower_rad=(-1.0,) * 7)


@pytest.mark.parametrize("config", [RunConfig(), scenario("blind"), CHANGED, RunConfig(arm=OWN)])
def test_a_configuration_comes_back_from_its_text(config):
    assert overlay(RunConfig(), loads(to_toml(config))) == config
    assert overlay(CHANGED, loads(f"arm = {literal(config.arm)}")).arm == config.arm


@given(name=st.text(), action=st.text())
def test_any_text_comes_back(name, action):
    learning = LearningConfig(programmed={name: action}, examples=name)
    assert overlay(LearningConfig(), loads(to_toml(learning))) == learning


def test_all_options_of_a_task_are_told_and_an_insertion_has_none():
    config = overlay(RunConfig(), {"task": {"name": "insertion-6dof", "options": {"corners": 4.0}}})
    message = with_options(config).task.options
    assert (message["corners"], message["down_share"]) == (4.0, 0.9)
    assert with_options(RunConfig()) == RunConfig()


@pytest.mark.parametrize(
    ("world", "options", "message"),
    [
        ("blind-square", {"corners": 3.0}, "task.options.corners must be 4, as the square peg"),
        ("blind-square", {"flat_deg": 30.0}, "task.options.flat_deg must be 0"),
        ("blind-hexagon", {"corners": 6.0, "corner_mm": 18.0}, "corner_mm must be at most 17.7"),
        ("blind-square", {"corners": 4.0, "inside_mm": 12.0}, "inside_mm must be at most task.area"),
        ("blind", {"corners": 4.0}, "0, as the round peg of cell.peg.cross_section has"),
        ("blind-square", {"corners": 4.0, "corner_mm": 20.5, "inside_mm": 6.5}, ""),
        ("blind-keyed", {"flat_deg": 37.5, "corner_mm": 11.5}, ""),
    ],
)
def test_corners_that_the_peg_of_the_cell_lacks_are_refused(world, options, message):
    task = {"name": "insertion-6dof", "options": options, "area_half_width_mm": 11.0}
    config = overlay(scenario(world), {"task": task})
    if not message:
        require_corners(config)
        return
    with pytest.raises(ConfigurationError) as refused:
        require_corners(config)
    assert message in str(refused.value)


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("insertoin", "did you mean insertion?"),
        ("math:pi", "a palpate.core.trial.TaskKind; math:pi has no preset"),
        ("no_such_package:KIND", "No module named 'no_such_package'"),
    ],
)
def test_what_is_no_kind_of_task_is_refused(name, message):
    with pytest.raises(ConfigurationError, match=r"task\.name") as refused:
        task_kind(name)
    assert message in str(refused.value)
    assert "\n" not in str(refused.value)
