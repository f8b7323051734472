"""Ctrl-C ends a command once and closes what is open whole; progress on a terminal and elsewhere."""

import json
import signal
import sys

import pytest

from palpate.adapters.cli import main
from palpate.adapters.cli.main import QUIET_S, Interrupts
from palpate.adapters.cli.progress import progress
from palpate.adapters.experiments import BLOCK, RunFolder
from palpate.adapters.log import TrialRecorder
from palpate.simulation.work_cell import WorkCell


def press(times=1, number=signal.SIGINT):
    for _ in range(times):
        signal.raise_signal(number)


@pytest.fixture
def now(monkeypatch):
    """The clock's reading in s, to be set by a test."""
    reading = [1000.0]
    monkeypatch.setattr(main, "monotonic", lambda: reading[0])
    return reading


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT])
def test_what_is_closed_meanwhile_is_not_interrupted(number, now):
    closed = []

    def work():
        try:
            press(1, number)
        finally:
            press(3)
            closed.append(now[0])

    with Interrupts() as seen, pytest.raises(KeyboardInterrupt):
        work()
    assert closed == now
    assert seen.raised


def test_who_still_waits_is_heard_again(now):
    with Interrupts():
        with pytest.raises(KeyboardInterrupt):
            press()
        now[0] += QUIET_S + 1.0
        with pytest.raises(KeyboardInterrupt):
            press()


def test_the_end_of_the_interpreter_is_not_interrupted(monkeypatch):
    monkeypatch.setattr(sys, "argv", ["palpate", "settings"])
    monkeypatch.setattr(main, "function_of", lambda name: lambda _: press())
    before = signal.getsignal(signal.SIGINT)
    try:
        assert main.main() == 130
        press(3)
    finally:
        signal.signal(signal.SIGINT, before)


def test_ctrl_c_again_and_again_leaves_one_line_and_a_log_that_replays(palpate, tmp_path, monkeypatch):
    passed, advance_once, fail_once = 0, WorkCell.advance, TrialRecorder.fail

    def advance(self):
        nonlocal passed
        passed += 1
        if passed == 600:
            press(2)
        advance_once(self)

    def fail(self, *message):
        press(2)
        fail_once(self, *message)
        press(2)

    monkeypatch.setattr(WorkCell, "advance", advance)
    monkeypatch.setattr(TrialRecorder, "fail", fail)
    done = palpate("run", "--task.time-limit-s", 1, "--policy", "random", "--trials", 50, "--out", tmp_path / "run")
    assert done.code == 130
    part, *rest = (line for line in done.stderr.splitlines() if line)
    assert "radial clearance" in part
    assert rest == ["palpate: stopped; finished results are kept"]
    monkeypatch.setattr(TrialRecorder, "fail", fail_once)
    logs = sorted((tmp_path / "run/logs").glob("*.mcap"))
    assert f"{len(logs)} of {len(logs)} equal" in palpate.succeed("replay", *logs, "--jobs", 1)


@pytest.mark.parametrize(("jobs", "kept"), [(2, BLOCK), (1, 1)])
def test_ctrl_c_while_trials_are_written_loses_none_of_them(palpate, tmp_path, monkeypatch, jobs, kept):
    append_once = RunFolder.append_trial

    def append(self, *scored):
        press()
        return append_once(self, *scored)

    monkeypatch.setattr(RunFolder, "append_trial", append)
    words = ("--task.time-limit-s", 0.5, "--policy", "random", "--jobs", jobs, "--trials", BLOCK + 1)
    assert palpate("run", *words, "--out", "run").code == 130
    lines = (tmp_path / "run" / "trials.csv").read_text().splitlines()
    summary = json.loads((tmp_path / "run" / "summary.json").read_text())
    assert summary["trials"] == len(lines) - 1 == kept
    assert summary["finished"] is False


def test_without_a_terminal_there_is_a_line_at_every_tenth(capsys):
    with progress(30, "trial", "torque", initial=2) as bar:
        for number in range(28):
            bar.set_postfix_str(f"time {number} s")
            bar.update()
    lines = capsys.readouterr().err.splitlines()
    assert lines[0] == "torque: 3 of 30 trials, time 0 s"
    assert [int(line.split()[1]) for line in lines] == list(range(3, 31, 3))
    with progress(30, "log", passing=True) as bar:
        bar.update(30)
    assert capsys.readouterr().err == ""


def test_on_a_terminal_there_is_a_bar(capsys, monkeypatch):
    monkeypatch.setattr("sys.stderr.isatty", lambda: True)
    with progress(2, "trial") as bar:
        bar.update()
    assert "\r" in capsys.readouterr().err
