"""Help, versions, and refusals in one line that says what would be accepted; of train, run, compare and show."""

import errno
import io
import os
import re
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path

import pytest

from palpate.adapters.cli.main import main
from palpate.core import __version__
from tests.command_line import CommandLine

LONG = "x" * 300
"""A name longer than any file system takes."""
RUN = ("--scenario", "--arm", "--seed", "--trials", "--policy", "--out", "--config")


@pytest.mark.parametrize(
    ("words", "shown"),
    [
        ("train", (*RUN, "--resume")),
        ("train --seed 3", RUN),
        ("run", RUN),
        ("compare", RUN),
        ("show", ()),
        ("study", ("--engine", "--jobs", "--yes", "--out", "[study]", "[grid]", "[[cells]]")),
        ("doctor", ("--rig", "--seconds", "--push", "--move")),
        ("report", ("--logs", "--no-logs")),
        ("log", ("\n  info ", "\n  plot ", "\n  export ", "\n  recover ")),
        ("log info", ("--json",)),
        ("log plot", ("--out",)),
        ("log export", ("--to",)),
        ("log recover", ("--out",)),
    ],
)
def test_every_command_explains_itself(palpate: CommandLine, words: str, shown: tuple[str, ...]) -> None:
    done = palpate(*words.split(), "--help")
    assert (done.code, done.stderr) == (0, "")
    assert f"palpate {re.split(' --', words)[0]}" in done.stdout
    assert [word for word in shown if word not in done.stdout] == []


@pytest.mark.parametrize(
    ("wide", "line"),
    [(80, "'palpate[rerun]'. What it is too slow"), (200, "What it is too slow for is dropped and counted;")],
)
def test_help_is_broken_where_the_terminal_ends_and_samples_are_not(
    palpate: CommandLine, monkeypatch: pytest.MonkeyPatch, wide: int, line: str
) -> None:
    monkeypatch.setenv("COLUMNS", str(wide))
    told = palpate.succeed("study", "--help")
    assert line in told
    assert '["q-learning", "torque"]    # learners are trained; comparators and policy files run as they are\n' in told


def test_palpate_alone_lists_its_commands(palpate: CommandLine) -> None:
    printed = palpate.succeed()
    for name in ("train", "run", "compare", "study", "show", "replay", "report", "log", "doctor", "emulate"):
        assert f"\n  {name} " in printed
    assert palpate.succeed("--help") == palpate.succeed("-h") == printed
    assert palpate.succeed("log") == palpate.succeed("log", "--help") == palpate.succeed("log", "-h")


def test_versions(palpate: CommandLine) -> None:
    printed = palpate.succeed("--version")
    assert printed.splitlines()[0] == f"palpate {version('palpate')}"
    assert f"mujoco {version('mujoco')}" in printed.splitlines()
    assert palpate.succeed("--version") == printed
    assert __version__ == version("palpate")
    module = [sys.executable, "-m", "palpate", "--version"]
    assert subprocess.run(module, capture_output=True, text=True, check=True).stdout == printed


@pytest.mark.parametrize(
    ("word", "near"),
    [("tarin", "did you mean train? there are"), ("log inof", "did you mean info?"), ("zzz", "; there")],
)
def test_a_command_with_a_slip_of_the_pen(palpate: CommandLine, word: str, near: str) -> None:
    assert near in palpate.refusal(*word.split())


SLIM = """
import sys

class Left:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] == "torch":
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)

sys.meta_path.insert(0, Left())
from palpate.adapters.cli.main import main
words = ["train", "--task.time-limit-s", "0.5", "--trials", "1", "--out", "run"]
print([main(one) for one in (words, ["replay", "run"], ["infer", "strings.txt", "--out", "automaton"])])
"""
"""Without torch from the start; a process that has it cannot be rid of it again."""


def test_without_what_a_slim_install_leaves_out_trials_run_and_what_needs_it_says_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The whole of a slim install is measured in an environment of its own, docs/results.md."""
    monkeypatch.chdir(tmp_path)
    Path("strings.txt").write_text("a b a\nb a\na a b b\n" * 4)
    done = subprocess.run([sys.executable, "-c", SLIM], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "[0, 0, 2]"
    assert "1 of 1 equal" in done.stdout
    refused = done.stderr.splitlines()[-1]
    assert refused == "palpate: this needs torch, which a slim install leaves out: pip install torch"


COMMANDS = (
    "train, run, compare, study, show, explore, infer, replay, report, log, "
    "render, check-adapter, emulate, doctor, calibrate, examples"
)


@pytest.mark.parametrize(
    ("words", "told"),
    [
        # Unknown words.
        ("frobnicate", COMMANDS),
        ("train --scenario dark", "scenario = 'dark' is refused: one of paper, blind"),
        ("train --scenario bilnd", "blind-keyed; did you mean blind?"),
        ("train --learner cat", "learner = 'cat' is refused: one of q-learning, sarsa, belief"),
        ("train --learner q-learning --learning.trace-decay 0.5", "sarsa or skills, which learning.trace_decay"),
        ("train --learning.belief.patience 5", "learner = 'q-learning' is refused: belief, which learning.belief"),
        ("train --learner belief --learning.alpha 0.5", "q-learning or sarsa or skills, which learning.alpha"),
        ("train --learner hmm --perception.memory last-2", "none with the learner hmm"),
        ("train --learner hmm --learning.hmm.lattice 0", "a lattice to round them to"),
        ("train --learner hmm --learning.hmm.reach 200", "160800 hidden states' is refused: at most 2896"),
        ("train --policy sarsa", "--learner sarsa chooses it"),
        ("train --arm puma", "arm = 'puma' is refused: one of zebra-zero, ur3, ur5"),
        ("run", "a policy file, or one of omniscient"),
        ("run --policy magic", "policy = 'magic' is refused: a policy file, or one of omniscient"),
        ("show", "policy file"),
        # Numbers out of range.
        ("train --task.goal.x-mm 1900", "zebra-zero reaches"),
        ("train --perception.cutoff-Hz 70", "perception.cutoff_Hz = 70.0 is refused: "),
        ("train --control.damping-N-s-per-m 1", "control.damping_N_s_per_m = 1.0 is refused: at least"),
        # Values of another type.
        ("train --perception.calibration 1 2", "6 values"),
        ("train --out", "Expected 1"),
        # Files and folders.
        ("train --config missing.toml", "missing.toml' is refused: a readable file"),
        ("train --config broken.toml", "a TOML file"),
        ("train --policy missing.json", "missing.json' is refused: a readable file"),
        ("run --policy a_file", "JSON"),
        ("run --policy torque --claim success", "success >= SHARE with a share between 0 and 1"),
        ("run --policy torque --jobs 2 --live rerun", "1 with --rig, --live or --view"),
        ("train --out a_file/run", "name another folder"),
        (f"train --out {LONG}", "name another folder"),
        ("train --out \udcff", "\\udcff is no text in UTF-8; give it another name"),
        ("train --out a_study", "a_study: already holds a run (run.toml)"),
        ("compare --policy deep.json", "JSON (maximum recursion depth"),
        (f"log export {LONG} --to csv --out x", "is not there; name a log"),
        ("log plot .", ".: is no file; name a log"),
        ("log recover .", ".: is no file; name a log"),
        ("log info a_pipe", "a_pipe: is no file; name a log"),
        ("log info \x1b[31m", "\\x1b[31m: is not there"),
    ],
)
def test_refused_in_one_line(palpate: CommandLine, words: str, told: str) -> None:
    Path("broken.toml").write_text("a = [")
    Path("a_file").touch()
    Path("deep.json").write_text("[" * 100_000)
    Path("a_study").mkdir()
    Path("a_study", "run.toml").touch()
    Path("a_loop").symlink_to("a_loop")
    os.mkfifo("a_pipe")
    palpate.refuses(words, told)


class FullDisk(io.StringIO):
    """An output that takes nothing."""

    def flush(self) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")


def test_an_output_that_is_closed_full_or_of_few_characters(
    palpate: CommandLine, trained: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
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


def test_a_working_folder_that_is_gone(
    palpate: CommandLine, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("gone").mkdir()
    monkeypatch.chdir("gone")
    Path("../gone").rmdir()
    assert main(["train"]) == 2
    assert "the working folder cannot be used (No such file or directory)" in capsys.readouterr().err


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
def test_a_folder_without_permission_is_refused(palpate: CommandLine, tmp_path: Path, words: str) -> None:
    locked = tmp_path / "locked"
    locked.mkdir(mode=0)
    try:
        assert "locked" in palpate(*words.split()).stderr
    finally:
        locked.chmod(0o700)
