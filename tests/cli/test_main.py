"""Help, versions, ``palpate settings``, and outputs that take nothing."""

import io
import sys
from importlib.metadata import version
from unittest.mock import Mock

import pytest

from palpate.adapters.cli.commands import COMMANDS
from palpate.adapters.cli.main import main
from palpate.adapters.config import RunConfig, described
from palpate.core import __version__


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_explains_itself(palpate, name):
    done = palpate(*name.split(), "--help")
    assert (done.code, done.stderr) == (0, "")
    assert f"palpate {name}" in done.stdout
    assert sum(line.startswith("  --") for line in done.stdout.splitlines()) <= 15


@pytest.mark.parametrize(
    ("wide", "line"), [(80, "neither on the\nnumber of workers"), (200, "neither on the number of workers")]
)
def test_help_is_broken_where_the_terminal_ends_and_samples_are_not(palpate, monkeypatch, wide, line):
    monkeypatch.setenv("COLUMNS", str(wide))
    message = palpate.succeed("study", "--help")
    assert line in message
    assert '["q-learning", "torque"]    # learners are trained; baselines and policy files run as they are\n' in message


def test_palpate_alone_lists_its_commands(palpate):
    printed = palpate.succeed()
    for name in ("train", "run", "compare", "study", "show", "replay", "report", "log", "rig", "emulate"):
        assert f"\n  {name} " in printed
    assert palpate.succeed("--help") == palpate.succeed("-h") == printed
    assert palpate.succeed("log") == palpate.succeed("log", "--help") == palpate.succeed("log", "-h")


def test_versions(palpate):
    printed = palpate.succeed("--version")
    assert printed.splitlines()[0] == f"palpate {version('palpate')}"
    assert f"mujoco {version('mujoco')}" in printed.splitlines()
    assert palpate.succeed("--version") == printed
    assert __version__ == version("palpate")


def test_misspelt_command_is_refused_with_the_nearest_one(palpate):
    assert "did you mean train? the commands are" in palpate.refusal("tarin")
    assert "did you mean info?" in palpate.refusal("log", "inof")


def test_an_output_that_is_closed_full_or_of_few_characters(palpate, trained, monkeypatch, capsys):
    words = ("log", "export", str(trained / "logs/trial-00000.mcap"), "--to", "csv", "--out")
    printed = io.BytesIO()
    monkeypatch.setattr(sys, "stdout", io.TextIOWrapper(printed, "ascii"))
    assert main([*words, "\u00fc"]) == 0
    assert printed.getvalue() == b"1 trial as CSV in \\xfc\n"
    monkeypatch.setattr(sys, "stdout", None)
    assert main([*words, "closed"]) == 0
    sys.stdout.close()
    monkeypatch.setattr(sys, "stdout", Mock(flush=Mock(side_effect=OSError(28, "No space left on device"))))
    assert main([*words, "full"]) == 1
    sys.stdout.close()
    assert capsys.readouterr().err == "palpate: No space left on device; earlier results are kept\n"


def test_settings_are_listed_by_groups(palpate):
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
def test_group_of_settings_that_is_not_there(palpate, name, near):
    assert near in palpate.refusal("settings", name)


def test_every_setting_of_a_run_has_a_help_text():
    assert [setting.name for setting in described(RunConfig) if not setting.text] == []
