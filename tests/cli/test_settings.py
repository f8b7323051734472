"""``palpate settings``, and the settings that it describes."""

import pytest

from palpate.adapters.config import RunConfig, described


def test_groups_and_what_is_in_them(palpate):
    groups = palpate.succeed("settings")
    for group in ("presets", "task", "cell", "learning", "arm.ur-rtde", "force_sensor.facts", "watchdog"):
        assert f"\n  {group} " in groups
    message = palpate.succeed("settings", "task")
    assert "task.step_mm = 0.7\n    (a number from 0.01 to 5, mm)\n    Length of one exploratory step.\n" in message
    assert "task.goal.x_mm = " in message
    assert palpate.succeed("settings", "task.step_mm") in message
    assert "arm.gain = 1000.0" in palpate.succeed("settings", "arm.ur-rtde")
    assert "--live-port = 0\n    (a whole number from 0 to 65535)" in palpate.succeed("settings", "run")


@pytest.mark.parametrize(("name", "near"), [("taks", "did you mean task?"), ("task.nothing", "did you mean task?")])
def test_group_that_is_not_there(palpate, name, near):
    assert near in palpate.refusal("settings", name)


def test_every_setting_of_a_run_has_a_help_text():
    assert [setting.name for setting in described(RunConfig) if not setting.text] == []
