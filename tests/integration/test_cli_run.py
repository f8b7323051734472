"""``palpate run``: trained policies and comparators, and the files that are none."""

from __future__ import annotations

import json
import shutil
import signal
import subprocess
from pathlib import Path

import pytest

from tests.integration.command_line import QUICK, command, files_in, finished_trials, refusal, succeed, wait_until


def test_a_trained_policy_runs_and_does_not_learn(trained: Path, tmp_path: Path) -> None:
    out = tmp_path / "run"
    policy = trained / "policy.json"
    printed = succeed("run", *QUICK, "--policy", policy, "--trials", 2, "--out", out)
    assert "2 trials" in printed
    assert {path.name for path in out.iterdir()} == {
        "run.toml", "trials.csv", "decisions.csv", "policy.json", "summary.json", "learning_curve.png",
        "logs",
    }  # fmt: skip
    assert sorted(path.name for path in (out / "logs").iterdir()) == ["trial-00000.mcap", "trial-00001.mcap"]
    assert finished_trials(out) == 2
    assert (out / "policy.json").read_bytes() == policy.read_bytes()
    summary = json.loads((out / "summary.json").read_text())
    assert (summary["policy"], summary["trials"], summary["finished"]) == (str(policy), 2, True)


def test_without_a_folder_named_each_run_gets_one_of_its_own(tmp_path: Path) -> None:
    for number in (1, 2):
        printed = succeed("run", "--policy", "omniscient", "--trials", 1, cwd=tmp_path)
        assert "success 100.0%" in printed
        assert f"saved in runs/paper-run-00{number}" in printed
    assert sorted(path.name for path in (tmp_path / "runs").iterdir()) == ["paper-run-001", "paper-run-002"]


def test_recording_can_be_switched_off(tmp_path: Path) -> None:
    out = tmp_path / "run"
    succeed("run", *QUICK, "--policy", "torque", "--trials", 1, "--out", out, "--recording.no-enabled")
    assert not (out / "logs").exists()


def test_the_other_arm_inserts_too(tmp_path: Path) -> None:
    printed = succeed("run", "--policy", "torque", "--arm", "ur5", "--trials", 2, cwd=tmp_path)
    assert "torque, ur5, scenario paper, seed 0: 2 trials" in printed
    assert "'inserted': 2" in printed


def test_equal_seeds_give_equal_trials(tmp_path: Path) -> None:
    for name in ("one", "two"):
        succeed("run", *QUICK, "--policy", "random", "--trials", 1, "--seed", 3, "--out", tmp_path / name)
    assert files_in(tmp_path / "one") == files_in(tmp_path / "two")


def test_ctrl_c_keeps_the_finished_trials(tmp_path: Path) -> None:
    out = tmp_path / "run"
    words = ("run", *QUICK, "--policy", "random", "--trials", 200, "--out", out)
    process = subprocess.Popen(command(*words), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    try:
        wait_until(lambda: finished_trials(out) >= 1, process)
        process.send_signal(signal.SIGINT)
        printed, complaint = process.communicate(timeout=60)
    finally:
        process.kill()
    assert process.returncode == 130
    assert "Traceback" not in complaint
    summary = json.loads((out / "summary.json").read_text())
    assert (summary["finished"], summary["trials"]) == (False, finished_trials(out))
    assert f"{summary['trials']} trials" in printed


@pytest.mark.parametrize("words", [("train",), ("run", "--policy", "torque"), ("compare",)])
def test_results_are_never_written_over(trained: Path, words: tuple[str, ...]) -> None:
    before = files_in(trained)
    line = refusal(*words, *QUICK, "--trials", 1, "--out", trained)
    assert str(trained) in line
    assert "already holds a run" in line
    assert files_in(trained) == before


def damaged(text: str, how: str) -> bytes:
    """A policy file of another kind."""
    content = json.loads(text)
    if how == "schema":
        content["schema"] = "palpate.policy/2"
    elif how == "truncated":
        return text[: len(text) // 2].encode()
    elif how == "prose":
        return b"once upon a time"
    elif how == "binary":
        return bytes(range(256))
    elif how == "list":
        return b"[1, 2]"
    elif how == "row":
        del content["table"][3]
    elif how == "number":
        content["table"][0]["q"] = "much"
    elif how == "perception":
        content["perception"] = {}
    return json.dumps(content).encode()


@pytest.mark.parametrize(
    ("how", "reason"),
    [
        ("schema", "schema = 'palpate.policy/2' is refused: 'palpate.policy/1'"),
        ("truncated", "JSON"),
        ("prose", "JSON"),
        ("binary", "UTF-8"),
        ("list", "policy file"),
        ("row", "table"),
        ("number", "table[0]"),
        ("perception", "perception"),
    ],
)
def test_a_file_that_is_no_policy_is_refused(trained: Path, tmp_path: Path, how: str, reason: str) -> None:
    path = tmp_path / "policy.json"
    path.write_bytes(damaged((trained / "policy.json").read_text(), how))
    assert reason in refusal("run", *QUICK, "--policy", path, "--trials", 1)


@pytest.mark.parametrize("command", ["run", "train", "compare"])
def test_a_policy_of_another_state_space_is_refused(trained: Path, tmp_path: Path, command: str) -> None:
    words = ("--perception.symbols", "grid", "--policy", trained / "policy.json", "--trials", 1)
    line = refusal(command, *words, "--out", tmp_path / "out")
    assert "states" in line
    assert "as in this task" in line
    assert list(tmp_path.iterdir()) == []


def test_a_policy_of_another_threshold_is_refused(trained: Path) -> None:
    words = ("--perception.position-threshold-mm", "1.5", "--policy", trained / "policy.json", "--trials", 1)
    line = refusal("run", *words)
    assert "-0.001" in line
    assert "-0.0015" in line


def test_show_needs_nothing_but_the_file(trained: Path, tmp_path: Path) -> None:
    path = Path(shutil.copy(trained / "policy.json", tmp_path))
    lines = succeed("show", path).splitlines()
    assert lines[0] == "17 states, 8 actions; q-learning, 3 trials learned"
    assert lines[2].split() == ["state", "source", "best", "action", "value", "visits"]
    assert len(lines) == 3 + 17
    path.write_text("{}")
    assert "schema" in refusal("show", path)


def test_a_reader_that_goes_away_is_no_reason_for_a_traceback(trained: Path) -> None:
    process = subprocess.Popen(
        command("show", trained / "policy.json"), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    assert process.stdout is not None
    assert process.stderr is not None
    process.stdout.close()  # as `palpate show policy.json | head -1` may do
    with process.stderr as stderr:
        assert stderr.read() == ""
    assert process.wait(timeout=60) == 1
