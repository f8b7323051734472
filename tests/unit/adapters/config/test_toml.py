"""Configurations to TOML and back, and how wrong tables are refused."""

from tomllib import loads

import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.adapters.config.compose import scenario
from palpate.adapters.config.run import LearningConfig, PerceptionConfig, RunConfig
from palpate.adapters.config.toml import literal, overlay, read_toml, to_toml
from palpate.core.errors import ConfigurationError
from palpate.core.motion import ArmDescription
from palpate.core.trial.config import GoalConfig, TaskConfig

CHANGED = RunConfig(
    scenario="blind",
    arm="ur5",
    seed=2**63 - 1,
    task=TaskConfig(goal=GoalConfig(x_mm=-1e-7), ticks_per_action=7),
    perception=PerceptionConfig(
        calibration=(1.0, -1.0, 1e-300, 2.5, 1e22, 0.1),
        symbols="random",
        channels=("fz", "tx"),
    ),
    learning=LearningConfig(
        alpha_visits=12.5,
        programmed={"x- y0": "+x", 'odd "name"\\': "-x"},
        examples="a folder/übung.csv",
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


@pytest.mark.parametrize("table", [{"task": 3}, {"task": {"goal": [1.0]}}])
def test_a_value_where_a_table_belongs_is_named(table):
    with pytest.raises(ConfigurationError, match=r"^task(\.goal)? = .* is refused: a table$"):
        overlay(RunConfig(), table)


@pytest.mark.parametrize("content", [None, b"a = [", b"a = '\xff'", b"a = " + b"[" * 2000 + b"]" * 2000])
def test_a_file_that_cannot_be_read_is_named(tmp_path, content):
    path = tmp_path / "run.toml"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(ConfigurationError, match=r"run\.toml"):
        read_toml(path)
