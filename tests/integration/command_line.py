"""The real command line in a process of its own, and what a run leaves behind."""

from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from palpate.adapters.cli.main import main

QUICK = ("--task.time-limit-s", "2")
"""Most trials with little learning end at the time limit: an early one keeps them short."""

RESULTS = (
    "trials.csv", "decisions.csv", "policy.json", "checkpoint.json", "summary.json", "learning_curve.png",
)  # fmt: skip
"""Files that equal runs leave equal, byte by byte."""

Done = subprocess.CompletedProcess[str]


RT_EMULATOR = ("--priority", 30)
"""Emulated devices that other tests' work does not hold up, where the system grants it."""


def command(*words: object) -> list[str]:
    """A call of palpate; warnings are errors in it, as they are in the tests themselves."""
    return [sys.executable, "-W", "error", "-m", "palpate.adapters.cli.main", *map(str, words)]


def palpate(*words: object, cwd: Path | None = None) -> Done:
    """Run palpate to its end."""
    return subprocess.run(
        command(*words), cwd=cwd, capture_output=True, text=True, timeout=120, check=False, stdin=subprocess.DEVNULL
    )


def succeed(*words: object, cwd: Path | None = None) -> str:
    """Run palpate, which must go well; returns what it printed."""
    done = palpate(*words, cwd=cwd)
    assert done.returncode == 0, done.stderr
    return done.stdout


def refusal(*words: object, cwd: Path | None = None) -> str:
    """Run palpate, which must refuse the call in one line; returns that line."""
    done = palpate(*words, cwd=cwd)
    assert "Traceback" not in done.stderr
    lines = done.stderr.splitlines()
    assert (done.returncode, len(lines), done.stdout) == (2, 1, ""), done
    assert lines[0].startswith("palpate: ")
    return lines[0]


def refused_here(words: str, desk: Path, capsys: pytest.CaptureFixture[str]) -> str:
    """Call palpate in this process, which must refuse in one line and leave every file as it is; returns that line."""
    before = files_in(desk)
    assert main(words.split()) == 2
    printed, complaint = capsys.readouterr()
    assert printed == ""
    (line,) = complaint.splitlines()
    assert line.startswith("palpate: ")
    # A refused call leaves nothing that would be in the way of the next one.
    assert files_in(desk) == before
    return line


def files_in(folder: Path) -> dict[str, bytes]:
    """Everything below a folder, by name."""
    return {
        str(path.relative_to(folder)): path.read_bytes() if path.is_file() else b""
        for path in sorted(folder.rglob("*"))
    }


def results_in(folder: Path) -> dict[str, bytes]:
    """The files of a training run that do not tell how it was called."""
    return {name: (folder / name).read_bytes() for name in RESULTS}


def wait_until(condition: Callable[[], bool], process: subprocess.Popen[str], patience_s: float = 60.0) -> None:
    """Wait for something that a running process brings about."""
    deadline = time.monotonic() + patience_s
    while not condition():
        assert process.poll() is None, "the process ended before"
        assert time.monotonic() < deadline, "it never happened"
        time.sleep(0.005)


def finished_trials(folder: Path) -> int:
    """Whole lines below the header of ``trials.csv``."""
    path = folder / "trials.csv"
    return max(path.read_bytes().count(b"\n") - 1, 0) if path.exists() else 0
