import tomllib
from dataclasses import asdict, replace

import pytest

from palpate.adapters.config.compose import scenario
from palpate.adapters.config.run import RunConfig
from palpate.adapters.experiments.policies import first_difference
from palpate.adapters.experiments.study.fields import configured, leaves, plain, plain_value, setting
from palpate.core.errors import ConfigurationError


@pytest.mark.parametrize(
    "text",
    [
        '"task.step_mm" = 0.5\n"cell.peg.clearance_mm" = 0.2',
        "task.step_mm = 0.5\ncell.peg.clearance_mm = 0.2",
        "[task]\nstep_mm = 0.5\n[cell.peg]\nclearance_mm = 0.2",
        '[task]\nstep_mm = 0.5\n[cell]\n"peg.clearance_mm" = 0.2',
    ],
)
def test_every_way_to_write_a_setting_in_toml_gives_its_dotted_name(text: str) -> None:
    assert leaves(tomllib.loads(text), "base") == {"task.step_mm": 0.5, "cell.peg.clearance_mm": 0.2}


def test_a_table_that_is_a_value_stays_one() -> None:
    table = tomllib.loads('[learning.programmed]\n"x+ y0" = "-x"')
    assert leaves(table, "base") == {"learning.programmed": {"x+ y0": "-x"}}


@pytest.mark.parametrize("text", ['"task.step_mm" = 1\ntask.step_mm = 1', "seed = 3"])
def test_a_setting_written_twice_and_the_seed_are_refused(text: str) -> None:
    with pytest.raises(ConfigurationError, match=r"grid\."):
        leaves(tomllib.loads(text), "grid")


def test_values_have_one_form() -> None:
    assert repr(plain_value("task.step_mm", 1)) == "1.0"
    assert plain_value("perception.channels", ["x", "y"]) == ["x", "y"]
    with pytest.raises(ConfigurationError, match=r"a number from 0\.01 to 5"):
        plain_value("task.step_mm", "1")


def test_settings_go_over_the_scenario_and_nothing_is_recorded_unless_asked() -> None:
    config = configured({"scenario": "blind", "task.step_mm": 0.5, "seed": 7}, "/desk")
    expected = scenario("blind")
    assert config.cell == expected.cell
    assert (config.task.step_mm, config.seed, config.recording.enabled) == (0.5, 7, False)
    assert configured({"recording.enabled": True}, "/desk").recording.enabled


def test_names_of_files_are_relative_to_the_folder_of_the_study() -> None:
    config = configured({"perception.memory": "a.json", "learning.examples": "/there/b.csv"}, "/desk")
    assert config.perception.memory == "/desk/a.json"
    assert config.learning.examples == "/there/b.csv"
    assert configured({"perception.memory": "last-2"}, "/desk").perception.memory == "last-2"


def test_a_setting_is_read_back_and_the_first_difference_found() -> None:
    config = RunConfig()
    assert setting(config, "perception.channels") == ["x", "y", "tx", "ty"]
    other = replace(config, cell=replace(config.cell, peg=replace(config.cell.peg, clearance_mm=0.3)))
    found = first_difference(plain(asdict(other)), plain(asdict(config)))
    assert found == (
        "cell.peg.clearance_mm",
        0.3,
        config.cell.peg.clearance_mm,
    )
