"""A training run that was ended or killed goes on as if it had not been."""

from __future__ import annotations

import shlex
import shutil
import signal
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from tests.integration.command_line import (
    QUICK,
    command,
    files_in,
    finished_trials,
    refusal,
    results_in,
    succeed,
    wait_until,
)


@contextmanager
def training(out: Path, *words: object) -> Iterator[subprocess.Popen[str]]:
    """A training that goes on for a long time, with its first trials done."""
    process = subprocess.Popen(
        command("train", *QUICK, *words, "--trials", 200, "--out", out),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        wait_until(lambda: finished_trials(out) >= 2, process)
        yield process
    finally:
        process.kill()
        process.communicate()


def logs_in(out: Path) -> dict[str, bytes]:
    """The recordings of the finished trials."""
    return {path.name: path.read_bytes() for path in (out / "logs").glob("*.mcap")}


def straight(out: Path, trials: int, *words: object) -> dict[str, bytes]:
    """Results of an uninterrupted run of so many trials."""
    succeed("train", *QUICK, *words, "--trials", trials, "--out", out)
    return results_in(out)


def test_ctrl_c_ends_in_order_and_the_message_tells_how_to_go_on(tmp_path: Path, trained: Path) -> None:
    # The space, and a policy to begin from, are traps for whoever prints the command to go on with.
    out = tmp_path / "a run"
    words = ("--policy", trained / "policy.json")
    with training(out, *words) as process:
        process.send_signal(signal.SIGINT)
        printed, complaint = process.communicate(timeout=60)
    assert process.returncode == 130
    assert "Traceback" not in complaint
    done = finished_trials(out)
    assert f"ended after {done} of 200 trials" in printed
    assert (out / "trials.csv").read_text().endswith("\n")
    assert not list(out.glob(".*"))
    # What is there is what a run of so many trials leaves, but for the summary, which says that it is not finished.
    left = results_in(out)
    assert b'"finished": false' in left.pop("summary.json")
    expected = straight(tmp_path / "ended", done, *words)
    expected.pop("summary.json")
    assert left == expected

    palpate, *again = shlex.split(printed.split("go on with: ")[1])
    assert palpate == "palpate"
    again[again.index("--trials") + 1] = str(done + 1)
    succeed(*again)
    assert results_in(out) == straight(tmp_path / "one more", done + 1, *words)


def test_a_run_that_was_killed_goes_on_as_if_it_had_not(tmp_path: Path) -> None:
    out = tmp_path / "run"
    with training(out) as process:
        process.send_signal(signal.SIGKILL)
        process.wait(timeout=60)
    # Whenever the blow came: make sure that a line is left in part.
    with (out / "trials.csv").open("a") as stream:
        stream.write("3,time lim")
    trials = finished_trials(out) + 1
    succeed("train", "--resume", "--out", out, "--trials", trials)
    assert results_in(out) == straight(tmp_path / "straight", trials)
    # The recordings are the same too; what the killed trial recorded is kept beside.
    assert logs_in(out) == logs_in(tmp_path / "straight")
    assert f"{trials} of {trials} equal" in succeed("replay", out)


def test_a_finished_run_can_be_extended(tmp_path: Path, trained: Path) -> None:
    out = tmp_path / "run"
    succeed("train", *QUICK, "--trials", 1, "--out", out)
    succeed("train", "--resume", "--trials", 3, "--out", out)
    assert results_in(out) == results_in(trained)


def test_a_run_that_reached_its_trials_is_left_alone(tmp_path: Path, trained: Path) -> None:
    out = Path(shutil.copytree(trained, tmp_path / "run"))
    # Naming the settings again is allowed as long as they are the same.
    succeed("train", *QUICK, "--config", out / "run.toml", "--resume", "--trials", 3, "--out", out)
    assert files_in(out) == files_in(trained)


@pytest.mark.parametrize(
    ("words", "reason"),
    [
        (("--seed", "1"), "seed = 1 (was seed = 0)"),
        (("--task.time-limit-s", "3"), "time_limit_s = 3.0 (was time_limit_s = 2.0)"),
        (("--learning.alpha-visits", "5"), "alpha_visits"),
        (("--policy", "policy.json"), "policy = 'policy.json' is refused: 'q-learning'"),
    ],
)
def test_another_configuration_is_refused(trained: Path, words: tuple[str, ...], reason: str) -> None:
    before = files_in(trained)
    assert reason in refusal("train", "--resume", *words, "--trials", 4, "--out", trained)
    assert files_in(trained) == before


def test_what_is_no_run_cannot_go_on(tmp_path: Path) -> None:
    (tmp_path / "empty").mkdir()
    for out in (tmp_path / "empty", tmp_path / "missing"):
        line = refusal("train", "--resume", "--trials", 4, "--out", out)
        assert "checkpoint.json" in line
        assert "begin a new run" in line
    assert [path.name for path in tmp_path.rglob("*")] == ["empty"]


def test_a_damaged_checkpoint_is_refused(trained: Path, tmp_path: Path) -> None:
    out = Path(shutil.copytree(trained, tmp_path / "run"))
    text = (out / "checkpoint.json").read_text()
    (out / "checkpoint.json").write_text(text[: len(text) // 2])
    before = files_in(out)
    assert "checkpoint.json" in refusal("train", "--resume", *QUICK, "--trials", 4, "--out", out)
    assert files_in(out) == before
