"""Presets, files, tables and flags make one configuration; settings that do not go together are refused by name."""

import inspect
import re
from dataclasses import replace
from pathlib import Path
from tomllib import loads

import pytest

from palpate.adapters.config import (
    JOB,
    SCENARIOS,
    RunConfig,
    compose,
    configured,
    overlay,
    scenario,
    task_kind,
    to_toml,
)
from palpate.adapters.experiments import ready_pose as ready_pose_of
from palpate.adapters.experiments import require_usable, run_toml
from palpate.core.errors import ConfigurationError
from tests.unit.adapters.config.test_declared import nested
from tests.unit.adapters.samples import ready_pose

PAGE = Path(__file__).parents[4] / "docs" / "how-to" / "choose-conditions.md"


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("task.max_force_N", 4.9),  # pressing alone would exceed it
        ("task.insertion_depth_mm", 0.7),  # the plate itself may lie as deep
        ("learning.alpha_floor", 0.31),  # above alpha itself
        ("control.damping_N_s_per_m", 10.0),
        ("control.position_gain_per_s", 1e4),
        ("control.force_integral_m_per_N_s", 1.0),
        ("cell.hole_height_error_mm", 4.0),
        ("cell.peg.hole_depth_mm", 5.0),
        # The regions of the paper are made of x, y, tx, ty; nothing else fits them.
        ("perception.symbols", {"channels": ["x", "y"]}),
        ("perception.symbols", {"symbols": "grid", "features": "som"}),
        ("perception.components", {"symbols": "clusters", "features": "pca", "components": 5}),
    ],
)
def test_setting_that_does_not_go_with_the_others_is_named(field, value):
    table = nested(field, value) if not isinstance(value, dict) else {"perception": value}
    with pytest.raises(ConfigurationError) as caught:
        # Gains are checked by the control laws themselves, when a task is built.
        require_usable(overlay(RunConfig(), table), ready_pose())
    assert caught.value.field == field


@pytest.mark.parametrize("name", ["insertion", "insertion-6dof"])
def test_force_that_ends_a_trial_is_the_supervisor_s(name):
    config = overlay(RunConfig(), task_kind(name).preset)
    assert config.supervision.max_force_N <= config.task.max_force_N


# Without a job file the preset job is the paper's.
PRESETS = {name: scenario(name) for name in SCENARIOS if name != JOB}
TURNED_MRAD = 10.0
"""Beyond it a tool that does not turn cannot tell the depth as well as is asked."""


@pytest.mark.parametrize("name", PRESETS)
def test_preset_can_be_run_differs_from_the_others_and_is_documented(name):
    config = scenario(name)
    usable = compose(name, task="insertion-6dof") if config.place.tilt_uncertainty_mrad > TURNED_MRAD else config
    require_usable(usable, ready_pose_of(usable))
    assert config.scenario == name
    assert overlay(RunConfig(), loads(to_toml(config))) == config
    assert sum(replace(other, scenario=name) == config for other in PRESETS.values()) == 1
    assert config.cell.hole_reach_mm <= config.task.area_half_width_mm
    assert re.search(rf"\b{name}\b", inspect.getsource(RunConfig))
    assert f"| `{name}` |" in PAGE.read_text(encoding="utf-8")


def test_arguments_win_over_settings_and_settings_over_the_preset():
    table = {"scenario": "blind", "arm": "ur5", "cell": {"hole_uncertainty_mm": 1.5}}
    config = configured(settings=table)
    assert (config.scenario, config.arm, config.cell.hole_uncertainty_mm) == ("blind", "ur5", 1.5)
    assert configured(scenario="blind") == scenario("blind")
    assert configured(scenario="blind", arm="zebra-zero", settings=table).arm == "zebra-zero"
    with pytest.raises(ConfigurationError, match="'blind', as in the settings"):
        configured(scenario="paper", settings=table)
    assert table["scenario"] == "blind"  # the caller's own table is left as it is


def test_file_of_a_run_serves_as_settings(tmp_path):
    config = configured(scenario="blind", arm="ur5", settings={"task": {"time_limit_s": 7.0}, "seed": 3})
    path = tmp_path / "run.toml"
    path.write_text(run_toml(config, "train", trials=3), encoding="utf-8")
    assert configured(settings=path) == configured(settings=str(path)) == config
