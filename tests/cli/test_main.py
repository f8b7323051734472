"""Help, versions, outputs that take nothing, and folders without permission."""

import errno
import io
import os
import re
import subprocess
import sys
from importlib.metadata import version

import pytest

from palpate.adapters.cli.main import main
from palpate.core import __version__

RUN = ("--scenario", "--arm", "--seed", "--trials", "--policy", "--out", "--config")


@pytest.mark.parametrize(
    ("words", "shown"),
    [
        ("train", (*RUN, "--resume")),
        ("train --seed 3", RUN),
        ("run", RUN),
        ("compare", RUN),
        ("show", ()),
        ("study", ("--jobs", "--out", "[study]", "[grid]", "[[grid]]")),
        ("rig", ("\n  doctor ", "\n  calibrate ", "\n  check ")),
        ("rig doctor", ("--rig", "--seconds", "--push", "--move")),
        ("report", ("--no-logs",)),
        ("log", ("\n  info ", "\n  plot ", "\n  export ")),
        ("log info", ("--json",)),
        ("log plot", ("--out",)),
        ("log export", ("--to",)),
    ],
)
def test_every_command_explains_itself(palpate, words, shown):
    done = palpate(*words.split(), "--help")
    assert (done.code, done.stderr) == (0, "")
    assert f"palpate {re.split(' --', words)[0]}" in done.stdout
    assert [word for word in shown if word not in done.stdout] == []


@pytest.mark.parametrize(
    ("wide", "line"), [(80, "neither on the\nnumber of workers"), (200, "neither on the number of workers")]
)
def test_help_is_broken_where_the_terminal_ends_and_samples_are_not(palpate, monkeypatch, wide, line):
    monkeypatch.setenv("COLUMNS", str(wide))
    told = palpate.succeed("study", "--help")
    assert line in told
    assert '["q-learning", "torque"]    # learners are trained; baselines and policy files run as they are\n' in told


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
    assert "did you mean train? there are" in palpate.refusal("tarin")
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
    assert capsys.readouterr().err == "palpate: No space left on device; what was finished before is kept\n"


@pytest.mark.skipif(os.geteuid() == 0, reason="root may go everywhere")
@pytest.mark.parametrize(
    "words",
    [
        "train --out locked/run",
        "train --out locked",
        "train --out locked --resume",
        "train --config locked/run.toml",
        "train --policy locked/policy.json",
        "run --policy locked/policy.json",
        "show locked/policy.json",
    ],
)
def test_a_folder_without_permission_is_refused(palpate, tmp_path, words):
    locked = tmp_path / "locked"
    locked.mkdir(mode=0)
    try:
        assert "locked" in palpate(*words.split()).stderr
    finally:
        locked.chmod(0o700)
