"""Help, versions, outputs that take nothing, and folders without permission."""

import errno
import io
import subprocess
import sys
from importlib.metadata import version

import pytest

from palpate.adapters.cli.commands import COMMANDS
from palpate.adapters.cli.main import main
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
    module = [sys.executable, "-m", "palpate", "--version"]
    assert subprocess.run(module, capture_output=True, text=True, check=True).stdout == printed


def test_misspelt_command_is_refused_with_the_nearest_one(palpate):
    assert "did you mean train? the commands are" in palpate.refusal("tarin")
    assert "did you mean info?" in palpate.refusal("log", "inof")


class FullDisk(io.StringIO):
    """An output that takes nothing."""

    def flush(self):
        raise OSError(errno.ENOSPC, "No space left on device")


def test_an_output_that_is_closed_full_or_of_few_characters(palpate, trained, monkeypatch, capsys):
    words = ("log", "export", str(trained / "logs/trial-00000.mcap"), "--to", "csv", "--out")
    printed = io.BytesIO()
    monkeypatch.setattr(sys, "stdout", io.TextIOWrapper(printed, "ascii"))
    assert main([*words, "\u00fc"]) == 0
    assert printed.getvalue() == b"1 trial as CSV in \\xfc\n"
    monkeypatch.setattr(sys, "stdout", None)
    assert main([*words, "closed"]) == 0
    sys.stdout.close()
    monkeypatch.setattr(sys, "stdout", FullDisk())
    assert main([*words, "full"]) == 1
    sys.stdout.close()
    assert capsys.readouterr().err == "palpate: No space left on device; earlier results are kept\n"
