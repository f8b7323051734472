import tomllib

import pytest

from palpate.adapters.config.compose import scenario
from palpate.adapters.experiments.study.settings import condition_config, plain_value, setting_of, settings_in
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
    assert settings_in(tomllib.loads(text)) == {"task.step_mm": 0.5, "cell.peg.clearance_mm": 0.2}


def test_values_have_one_form() -> None:
    assert repr(plain_value("task.step_mm", 1)) == "1.0"
    assert plain_value("perception.channels", ["x", "y"]) == ["x", "y"]
    with pytest.raises(ConfigurationError, match=r"a number from 0\.01 to 5"):
        plain_value("task.step_mm", "1")


def test_settings_go_over_the_scenario_and_nothing_is_recorded_unless_the_file_says_so() -> None:
    config = condition_config({"scenario": "blind", "task.step_mm": 0.5}, "torque")
    expected = scenario("blind")
    assert config.cell == expected.cell
    assert (config.task.step_mm, config.recording.enabled) == (0.5, False)
    assert condition_config({"recording.enabled": True}, "torque").recording.enabled
    assert setting_of(config, "perception.channels") == ["x", "y", "tx", "ty"]
