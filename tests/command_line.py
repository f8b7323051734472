"""The command line for tests: called in this process, or in one of its own where that is what a test is about."""

import io
import os
import signal
import subprocess
import sys
import time
from contextlib import ExitStack, redirect_stderr, redirect_stdout
from pathlib import Path
from typing import NamedTuple

import pytest

from palpate.adapters.cli.main import main
from palpate.adapters.signals import ENDING

QUICK = ("--task.time-limit-s", "0.5")
"""Trials with little learning end at the time limit: an early one keeps them short."""

RESULTS = ("trials.csv", "decisions.csv", "policy.json", "checkpoint.json", "summary.json", "learning_curve.png")
"""Files that equal runs leave equal, byte by byte."""

TIMEOUT_S = 100.0
"""With a process; only its end after Ctrl-C takes two seconds of a processor, of which a busy machine may give 3 %."""

RT_EMULATOR = ("--priority", 30)
"""Emulated devices that other tests' work does not hold up, where the system grants it."""

JOB = ("--job", str(Path(__file__).parent / "support" / "job.toml"))
"""A job without an arm, for rigs that state theirs."""

STUDY = """
[study]
trials = 2
seeds = [0, 1]
policies = ["q-learning", "torque"]
[base]
task.time_limit_s = 0.3
"""


class Done(NamedTuple):
    """What a command came to."""

    code: int
    stdout: str
    stderr: str


class Output(io.StringIO):
    """Where a command prints; no terminal, unless a test makes it one."""


class CommandLine:
    """Calls palpate in this process, as the installed script would; the process is left as it was found."""

    def __call__(self, *words):
        """Run a command to its end."""
        stdout, stderr = Output(), Output()
        before = _process_state()
        with ExitStack() as stack:
            stack.enter_context(redirect_stdout(stdout))
            stack.enter_context(redirect_stderr(stderr))
            try:
                code = main([str(word) for word in words])
            except SystemExit as end:
                code = int(end.code or 0)
        after = _process_state()
        assert {name: after[name] for name in before} == before
        return Done(code, stdout.getvalue(), stderr.getvalue())

    def succeed(self, *words):
        """Run a command that must go well; returns what it printed."""
        done = self(*words)
        assert done.code == 0, done
        return done.stdout

    def refusal(self, *words):
        """Run a command that must refuse in one line, and leave every file here as it is; returns that line."""
        before = files_in(Path.cwd())
        done = self(*words)
        lines = done.stderr.splitlines()
        assert (done.code, len(lines), done.stdout) == (2, 1, ""), done
        assert lines[0].startswith("palpate: ")
        # A refused call leaves nothing that would be in the way of the next one.
        assert files_in(Path.cwd()) == before
        return lines[0]

    def refuses(self, words, *message):
        """Refuse these words as in :meth:`refusal`, in a line that contains all given texts."""
        line = self.refusal(*words.split())
        assert [part for part in message if part not in line] == [], line


def _process_state():
    """What a command might leave changed behind it."""
    numbers = (*ENDING, signal.SIGPIPE, signal.SIGCHLD)
    state = {
        "signal handlers": [signal.getsignal(number) for number in numbers],
        # Libraries set variables and search folders of their own when they are imported.
        "environment": {name: os.environ.get(name) for name in ("MUJOCO_GL", "PATH", "PYTHONPATH", "OMP_NUM_THREADS")},
        "working directory": Path.cwd(),
        "import path": [path for path in sys.path if Path(path).resolve().is_relative_to(Path.cwd())],
    }
    if "matplotlib" in sys.modules:
        state["matplotlib"] = dict.copy(sys.modules["matplotlib"].rcParams)
    return state


@pytest.fixture
def palpate(tmp_path, monkeypatch):
    """The command line, in a new working directory."""
    monkeypatch.chdir(tmp_path)
    return CommandLine()


def command(*words):
    """A call of palpate in a process of its own; warnings are errors in it, as they are in the tests themselves."""
    return [sys.executable, "-W", "error", "-m", "palpate.adapters.cli.main", *map(str, words)]


@pytest.fixture
def start():
    """Starts commands in processes of their own, which end with the test."""
    processes = []

    def begin(*words):
        process = subprocess.Popen(command(*words), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        processes.append(process)
        return process

    yield begin
    for process in processes:
        process.kill()
        process.communicate()


def wait_until(condition, process, timeout_s=TIMEOUT_S):
    """Wait for something that a running process brings about."""
    deadline = time.monotonic() + timeout_s
    while not condition():
        assert process.poll() is None, "the process ended before"
        assert time.monotonic() < deadline, "it never happened"
        time.sleep(0.005)


def shared_folder(factory, name, make):
    """A folder that is made once and read by the tests of all workers of pytest-xdist."""
    base = factory.getbasetemp()
    root = base.parent if "PYTEST_XDIST_WORKER" in os.environ else base
    folder, lock, failed = root / name, root / f"{name}.lock", root / f"{name}.failed"
    try:
        lock.mkdir()
    except FileExistsError:
        while not (done := lock / "done").exists() and not failed.exists():
            time.sleep(0.02)
        assert done.exists(), f"another worker could not make {name}"
    else:
        try:
            make(folder)
            (lock / "done").touch()
        except BaseException:
            failed.touch()
            raise
    return folder


def files_in(folder):
    """Everything below a folder, by name, but for the bytecode that an import leaves."""
    return {
        str(path.relative_to(folder)): path.read_bytes() if path.is_file() else b""
        for path in sorted(folder.rglob("*"))
        if "__pycache__" not in path.parts
    }


def results_in(folder):
    """The files of a training run that do not say how it was called."""
    return {name: (folder / name).read_bytes() for name in RESULTS}


def finished_trials(folder):
    """Whole lines below the header of ``trials.csv``."""
    path = folder / "trials.csv"
    return max(path.read_bytes().count(b"\n") - 1, 0) if path.exists() else 0
