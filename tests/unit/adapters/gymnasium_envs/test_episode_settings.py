"""Keyword arguments become the configuration that a run would have."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from palpate.adapters.config.run import RunConfig, scenario
from palpate.adapters.experiments.training import run_toml
from palpate.adapters.gymnasium_envs.episode import run_config
from palpate.core.errors import ConfigurationError


def test_nothing_said_is_the_paper_scenario() -> None:
    assert run_config("", "", None) == RunConfig()


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


@pytest.mark.parametrize(
    ("arguments", "field"),
    [
        (("papr", "", None), "scenario"),
        (("", "", {"task": {"step": 1.0}}), "task.step"),
        (("", "", {"task": {"step_mm": 99}}), "task.step_mm"),
        (("", "", {"task": 1}), "task"),
        (("", "", "no-such-file.toml"), "config"),
        (("", "", 5), "config"),
    ],
)
def test_what_there_is_not_is_refused_by_name(arguments: Any, field: str) -> None:
    with pytest.raises(ConfigurationError) as caught:
        run_config(*arguments)
    assert caught.value.field == field
