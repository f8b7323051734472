"""``palpate run`` with trained policies and baselines, the files that are no policy, and ``palpate show``."""

import csv
import json
import shutil
import signal
from pathlib import Path

import pytest

from palpate.adapters.experiments import planning
from palpate.simulation.work_cell.cell import WorkCell
from tests.command_line import QUICK, finished_trials


def test_trained_policy_runs_and_does_not_learn(palpate, trained, tmp_path):
    out, policy = tmp_path / "run", trained / "policy.json"
    assert "2 trials" in palpate.succeed("run", *QUICK, "--policy", policy, "--trials", 2, "--out", out)
    assert {path.name for path in out.iterdir()} == {
        "run.toml", "trials.csv", "decisions.csv", "policy.json", "summary.json", "trials.png", "logs",
    }  # fmt: skip
    assert sorted(path.name for path in (out / "logs").iterdir()) == ["trial-00000.mcap", "trial-00001.mcap"]
    assert finished_trials(out) == 2
    assert (out / "policy.json").read_bytes() == policy.read_bytes()
    summary = json.loads((out / "summary.json").read_text())
    assert (summary["policy"], summary["trials"], summary["finished"]) == (str(policy), 2, True)
    assert "2 of 2 equal" in palpate.succeed("replay", out, "--jobs", 1)


@pytest.fixture
def two_blocks(monkeypatch):
    """The number of trials that are two blocks, which two processes share."""
    monkeypatch.setattr(planning, "BLOCK", 3)
    return 5


def test_claim_is_judged_and_trials_are_the_same_in_one_process_and_in_two_and_replay(palpate, two_blocks):
    words = ("run", "--task.ready-height-mm", 1, *QUICK, "--policy", "oracle", "--trials", two_blocks)
    # Workers keep the folder in which they were begun.
    printed = palpate.succeed(*words, "--out", "two", "--jobs", 2, "--claim", "success >= 0.4")
    assert "success 100.0% (95 % interval 47.82% to 100.00%)" in printed
    assert "claim success >= 0.4: proved" in printed
    assert "5 of 5 equal" in palpate.succeed("replay", "two", "--jobs", 1)
    done = palpate(*words, "--out", "one", "--recording.no-enabled", "--claim", "success >= 0.99")
    assert done.code == 1
    assert "claim success >= 0.99: inconclusive" in done.stdout
    for name in ("trials.csv", "decisions.csv"):
        assert Path("one", name).read_bytes() == Path("two", name).read_bytes()


COUNTING = """
from palpate.core.policy import Action, Decision, FixedPolicy

class Counting(FixedPolicy):
    trials = 0

    def begin_trial(self, trial, rng):
        self.trials += 1

    def choose(self, observation):
        return Decision(Action(f"trial {self.trials}", (1e-4, 0.0)), None, "counting")
"""


def test_one_policy_object_serves_all_trials_of_one_process(palpate, monkeypatch, two_blocks):
    monkeypatch.syspath_prepend(str(Path.cwd()))
    Path("counting.py").write_text(COUNTING)
    words = ("--policy", "counting:Counting", "--cell.hole-uncertainty-mm", 3, "--trials", two_blocks, *QUICK)
    palpate.succeed("run", *words, "--recording.no-enabled", "--out", "run")
    with Path("run/decisions.csv").open() as rows:
        actions = {row["action"] for row in csv.DictReader(rows)}
    assert f"trial {two_blocks}" in actions


STRICT = ("--supervision.max-force-N", 6, *QUICK)
"""A limit that some honest trials exceed."""
TRIPPING = 6


def test_trips_in_the_simulator_are_counted_and_the_run_goes_on(palpate):
    words = ("--policy", "torque", *STRICT, "--trials", TRIPPING, "--claim", "success >= 0.99")
    done = palpate("run", *words, "--out", "out")
    with Path("out/trials.csv").open() as lines:
        rows = list(csv.DictReader(lines))
    tripped = [row for row in rows if row["trip"]]
    assert len(rows) == TRIPPING
    assert {(row["outcome"], row["success"], row["exploration_time_s"]) for row in tripped} == {
        ("safety trip", "False", "0.5")
    }
    counted = f"trips: {len(tripped)} of {TRIPPING} trials, counted as failures at the time limit"
    assert f"{counted} (FORCE_LIMIT {len(tripped)})" in done.stdout
    assert "claim success >= 0.99: refuted" in done.stdout
    assert json.loads(Path("out/summary.json").read_text())["trips"] == {"FORCE_LIMIT": len(tripped)}
    palpate.succeed("report", "out")
    page = Path("out/report.html").read_text(encoding="utf-8")
    assert f"Trips, each counted as a failure at the time limit: {len(tripped)}" in page
    assert "FORCE_LIMIT: force " in page


def test_ctrl_c_keeps_the_finished_trials_and_the_last_one_replays(palpate, tmp_path, monkeypatch):
    out, passed, advance_once = tmp_path / "run", 0, WorkCell.advance

    def advance(self):
        nonlocal passed
        passed += 1
        if passed == 600:
            signal.raise_signal(signal.SIGINT)
        advance_once(self)

    monkeypatch.setattr(WorkCell, "advance", advance)
    done = palpate("run", "--task.time-limit-s", 1, "--policy", "random", "--trials", 50, "--out", out)
    assert done.code == 130
    summary = json.loads((out / "summary.json").read_text())
    assert 0 < finished_trials(out) < 5
    assert (summary["finished"], summary["trials"]) == (False, finished_trials(out))
    printed = palpate.succeed("replay", sorted((out / "logs").glob("*.mcap"))[-1])
    assert "interrupted" in printed
    assert "1 of 1 equal" in printed


@pytest.mark.parametrize("name", ["run", "train", "compare"])
def test_policy_of_another_state_space_is_refused(palpate, trained, name):
    words = ("--policy", trained / "policy.json", "--trials", 1, "--out", "out")
    assert "as in this task" in palpate.refusal(name, "--perception.symbols", "grid", *words)


def test_show_needs_nothing_but_the_file(palpate, trained):
    shutil.copy(trained / "policy.json", ".")
    lines = palpate.succeed("show", "policy.json").splitlines()
    assert lines[0] == "17 states, 8 actions; q-learning, trained on 3 trials"
    assert lines[2].split() == ["state", "source", "best", "action", "value", "visits"]
    assert len(lines) == 3 + 17
    Path("policy.json").write_text("{}")
    assert "schema" in palpate.refusal("show", "policy.json")


def test_logs_that_lost_their_ends_are_told_and_make_the_run_fail(palpate, monkeypatch):
    lost = "trial-00000.mcap: cannot be written (No space left on device); nothing after that is kept"
    monkeypatch.setattr("palpate.adapters.log.sink.FileSink.close", lambda sink: sink.losses.append(lost))
    done = palpate("run", "--policy", "random", "--trials", 1, *QUICK, "--out", "run")
    assert done.code == 1
    assert f"palpate: recording: {lost}" in done.stderr
    full = Path("/dev/full").write_text
    monkeypatch.setattr("palpate.adapters.experiments.results.RunFolder.append_trial", lambda *_: full("x"))
    done = palpate("run", "--policy", "random", "--trials", 1, *QUICK, "--out", "again")
    said = [line for line in done.stderr.splitlines() if "No space" in line]
    assert (done.code, said) == (1, [f"palpate: recording: {lost}; earlier results are kept"])
