"""Configurations of files, presets and tables, as programs and environments state them."""

from pathlib import Path

from palpate.adapters.config import configured, scenario
from palpate.adapters.experiments import run_toml


def test_arguments_win_over_settings_and_settings_over_the_preset() -> None:
    table = {"scenario": "blind", "arm": "ur5", "cell": {"hole_uncertainty_mm": 1.5}}
    config = configured(settings=table)
    assert (config.scenario, config.arm, config.cell.hole_uncertainty_mm) == ("blind", "ur5", 1.5)
    assert configured(scenario="blind") == scenario("blind")
    assert configured(scenario="paper", arm="zebra-zero", settings=table).arm == "zebra-zero"
    assert table["scenario"] == "blind"  # the caller's own table is left as it is


def test_the_file_of_a_run_serves_as_settings(tmp_path: Path) -> None:
    config = configured(scenario="blind", arm="ur5", settings={"task": {"time_limit_s": 7.0}, "seed": 3})
    path = tmp_path / "run.toml"
    path.write_text(run_toml(config, "train", trials=3), encoding="utf-8")
    assert configured(settings=path) == configured(settings=str(path)) == config
