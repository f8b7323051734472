"""``palpate study``: cells like runs of their own, on any engine, interrupted, killed, extended, never made twice."""

from __future__ import annotations

import io
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from palpate.adapters.cli.main import main
from palpate.adapters.experiments.study.cell import StudyCell
from tests.integration.command_line import RESULTS, command, files_in, refused_here, results_in, succeed, wait_until

SMALL = """
[study]
trials = 2
seeds = [0, 1]
policies = ["q-learning", "torque"]
[base]
task.time_limit_s = 0.3
"""
SLOW = """
[study]
trials = 9
seeds = [0, 1]
policies = ["random"]
[base]
task.time_limit_s = 1.0
"""
"""A cell of it lasts long enough to be met in the making."""


def run(text: str, out: Path, *words: str) -> int:
    """Run a study in this process."""
    file = out.parent / f"{out.name}.toml"
    file.write_text(text)
    return main(["study", str(file), "--out", str(out), *words])


@pytest.fixture(scope="module")
def done(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of the small study; to be read, not changed."""
    out = tmp_path_factory.mktemp("done") / "out"
    assert run(SMALL, out, "--engine", "sequential") == 0
    return out


def cells_in(out: Path) -> list[Path]:
    folder = out / "cells"
    return sorted(path for path in folder.iterdir() if path.suffix != ".unfinished") if folder.exists() else []


def begun_in(out: Path) -> list[Path]:
    return sorted((out / "cells").glob("*.unfinished"))


def times_in(out: Path) -> dict[str, int]:
    return {str(path.relative_to(out)): path.stat().st_mtime_ns for path in (out / "cells").rglob("*")}


def test_a_cell_is_what_train_leaves(done: Path, tmp_path: Path) -> None:
    cell = done / "cells" / StudyCell({}, "q-learning", 1).name
    flags = ("--task.time-limit-s", 0.3, "--trials", 2, "--seed", 1, "--recording.no-enabled")
    succeed("train", *flags, "--out", tmp_path / "run")
    assert results_in(cell) == results_in(tmp_path / "run")
    assert (cell / "run.toml").read_bytes() == (tmp_path / "run" / "run.toml").read_bytes()
    assert {path.name for path in cell.iterdir()} == {*RESULTS, "run.toml", "cell.json"}


def test_a_cell_is_what_run_leaves(done: Path, tmp_path: Path) -> None:
    cell = done / "cells" / StudyCell({}, "torque", 1).name
    flags = ("--task.time-limit-s", 0.3, "--trials", 2, "--seed", 1, "--recording.no-enabled")
    succeed("run", "--policy", "torque", *flags, "--out", tmp_path / "run")
    assert files_in(cell) == {**files_in(tmp_path / "run"), "cell.json": (cell / "cell.json").read_bytes()}


def test_processes_leave_the_same_bytes(done: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    assert run(SMALL, out, "--jobs", "2") == 0
    assert files_in(out) == files_in(done)


def test_finished_cells_are_not_made_again(done: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "out"
    assert run(SMALL.replace("[0, 1]", "[1]"), out, "--engine", "sequential") == 0
    before = times_in(out)
    assert len(cells_in(out)) == 2
    assert run(SMALL, out, "--engine", "sequential") == 0
    assert "2 of them are finished already" in capsys.readouterr().out
    assert before.items() <= times_in(out).items()
    assert files_in(out) == files_in(done)
    # Nor with what the folder itself says was asked.
    before = times_in(out)
    assert main(["study", str(out / "study.toml"), "--out", str(out), "--engine", "sequential"]) == 0
    assert times_in(out) == before
    assert files_in(out) == files_in(done)


def test_a_half_written_cell_is_made_anew_and_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out, text = tmp_path / "out", SMALL.replace('"q-learning", ', "")
    assert run(text, out, "--engine", "sequential") == 0
    whole = files_in(out)
    first, second = cells_in(out)
    (first / "cell.json").unlink()
    (out / "cells" / f"{first.name}.0f.unfinished").mkdir()
    capsys.readouterr()
    untouched = second.stat().st_mtime_ns
    assert run(text, out, "--engine", "sequential") == 0
    assert f"palpate: {first.name} was begun and not finished: it is made anew\n" in capsys.readouterr().err
    assert files_in(out) == whole
    assert second.stat().st_mtime_ns == untouched


def test_a_cell_that_fails_is_told_and_the_others_are_made(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("palpate.adapters.cli.study.require_possible", lambda study: None)
    out = tmp_path / "out"
    text = SMALL.replace("[0, 1]", "[0]") + "[grid]\ntask.goal.x_mm = [400.0, 1900.0]\n"
    assert run(text, out, "--engine", "sequential") == 1
    printed, complaint = capsys.readouterr()
    assert "2 of 4 cells are finished" in printed
    assert "2 cells failed" in printed
    assert complaint.count("failed: task.goal = ") == 2
    assert [path.name.split("-seed")[0] for path in cells_in(out)] == ["q-learning-x_mm-400.0", "torque-x_mm-400.0"]
    assert len((out / "summary.csv").read_text().splitlines()) == 3


@pytest.fixture
def started(tmp_path: Path) -> Iterator[Callable[..., subprocess.Popen[str]]]:
    """Starts the slow study in a process of its own."""
    (tmp_path / "slow.toml").write_text(SLOW)
    processes: list[subprocess.Popen[str]] = []

    def start(*words: object) -> subprocess.Popen[str]:
        call = command("study", tmp_path / "slow.toml", "--out", tmp_path / "out", *words)
        process = subprocess.Popen(call, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        processes.append(process)
        return process

    yield start
    for process in processes:
        process.kill()
        process.communicate()


def workers_of(process: subprocess.Popen[str]) -> list[int]:
    """The worker processes of a study."""
    # Each is a child of the thread that started it.
    lists = Path(f"/proc/{process.pid}/task").glob("*/children")
    children = [child for started in lists for child in started.read_text().split()]
    return [int(child) for child in children if b"spawn_main" in Path(f"/proc/{child}/cmdline").read_bytes()]


def test_killing_a_worker_loses_one_cell_which_is_made_anew(
    tmp_path: Path, started: Callable[..., subprocess.Popen[str]]
) -> None:
    out = tmp_path / "out"
    process = started("--jobs", 1)
    wait_until(lambda: len(cells_in(out)) == 1 and len(begun_in(out)) == 1, process)
    (finished,) = cells_in(out)
    before = finished.stat().st_mtime_ns
    (victim,) = begun_in(out)
    (worker,) = workers_of(process)
    os.kill(worker, signal.SIGKILL)
    printed, complaint = process.communicate(timeout=60)
    assert process.returncode == 0, complaint
    assert f"palpate: a worker died over {victim.name.rsplit('.', 2)[0]}: it is made anew" in complaint
    assert "2 of 2 cells are finished" in printed
    assert begun_in(out) == []
    assert finished.stat().st_mtime_ns == before
    whole = files_in(out)
    assert run(SLOW, tmp_path / "again", "--engine", "sequential") == 0
    assert whole == files_in(tmp_path / "again")


@pytest.mark.parametrize("engine", ["processes", "sequential"])
def test_an_interrupted_study_keeps_what_is_finished_and_goes_on(
    tmp_path: Path, started: Callable[..., subprocess.Popen[str]], engine: str
) -> None:
    out = tmp_path / "out"
    process = started("--jobs", 1, "--engine", engine)
    wait_until(lambda: len(cells_in(out)) == 1 and len(begun_in(out)) == 1, process)
    workers = workers_of(process)
    process.send_signal(signal.SIGINT)
    printed, complaint = process.communicate(timeout=60)
    assert process.returncode == 130
    assert "Traceback" not in complaint
    assert "1 of 2 cells are finished" in printed
    assert f"go on with: palpate study {tmp_path}/slow.toml --out {out}" in printed
    assert (len(cells_in(out)), begun_in(out)) == (1, [])
    assert len((out / "summary.csv").read_text().splitlines()) == 2
    assert not any(os.path.exists(f"/proc/{worker}") for worker in workers)


def test_a_killed_study_leaves_no_workers_and_goes_on(
    tmp_path: Path, started: Callable[..., subprocess.Popen[str]], capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    process = started("--jobs", 1)
    wait_until(lambda: len(cells_in(out)) == 1 and len(begun_in(out)) == 1, process)
    (worker,) = workers_of(process)
    process.kill()
    process.wait()
    deadline = time.monotonic() + 20.0
    while os.path.exists(f"/proc/{worker}"):
        assert time.monotonic() < deadline, "the worker outlives the study"
        time.sleep(0.05)
    assert len(begun_in(out)) == 1
    (finished,) = cells_in(out)
    before = finished.stat().st_mtime_ns
    assert run(SLOW, out, "--engine", "sequential") == 0
    assert "was begun and not finished: it is made anew" in capsys.readouterr().err
    assert finished.stat().st_mtime_ns == before
    assert (len(cells_in(out)), begun_in(out)) == (2, [])


def test_dask_leaves_the_same_bytes_also_when_a_worker_dies(
    done: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    from distributed import LocalCluster

    out = tmp_path / "out"
    ended = threading.Event()
    killed: list[int] = []

    def kill_one() -> None:
        while not ended.is_set() and not killed:
            if len(begun_in(out)) == 2:
                worker = next(iter(cluster.workers.values())).pid
                os.kill(worker, signal.SIGKILL)
                killed.append(worker)
            time.sleep(0.002)

    with LocalCluster(n_workers=2, threads_per_worker=1, host="127.0.0.1", dashboard_address=None) as cluster:
        hunter = threading.Thread(target=kill_one)
        hunter.start()
        try:
            assert run(SMALL, out, "--scheduler", cluster.scheduler_address) == 0
        finally:
            ended.set()
            hunter.join()
    assert killed
    assert "a worker died over" in capsys.readouterr().err
    assert files_in(out) == files_in(done)


@pytest.fixture
def desk(tmp_path: Path) -> Path:
    """A folder with studies that do not do."""
    texts = {
        "small": SMALL,
        "unknown": "[grid]\n'task.stepp_mm' = [1.0]",
        "empty": "[grid]\n'task.step_mm' = []",
        "twice": "[grid]\n'task.step_mm' = [1, 1.0]",
        "type": "[grid]\n'task.step_mm' = ['one']",
        "range": "[grid]\n'task.step_mm' = [0.5, 100.0]",
        "together": "[grid]\n'task.start_uncertainty_mm' = [3.0, 5.0]",
        "reach": "[grid]\n'task.goal.x_mm' = [400.0, 1900.0]",
        "policy": "[study]\npolicies = ['torqe']",
        "document": "[study]\npolicies = ['small.toml']",
        "memory": "[base]\nperception.memory = 'nowhere.json'",
        "programmed": "[base.learning.programmed]\nnowhere = '+x'",
        "broken": "[study",
        "million": "[study]\ntrials = 10\nseeds = { first = 0, count = 1000000 }",
        "billion": "[study]\nseeds = { count = 1000000 }\n[grid]\n'task.tare_ticks' = [1,2,3,4,5,6,7,8,9,10,11]",
    }
    for name, text in texts.items():
        (tmp_path / f"{name}.toml").write_text(text)
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / "notes.txt").touch()
    return tmp_path


@pytest.mark.parametrize(
    ("words", "named", "accepted"),
    [
        ("", "palpate study", "study file"),
        ("missing.toml", "missing.toml", "a readable file"),
        ("broken.toml", "broken.toml", "a TOML file"),
        ("unknown.toml", "task.stepp_mm", "did you mean task.step_mm?"),
        ("empty.toml", "grid.task.step_mm = []", "at least one value"),
        ("twice.toml", "grid.task.step_mm = 1.0", "once"),
        ("type.toml", "task.step_mm = 'one'", "float"),
        ("range.toml", "task.step_mm = 100.0", "from 0.01 to 5"),
        ("together.toml", "task.start_uncertainty_mm = 5.0", "at most task.area_half_width_mm"),
        ("reach.toml", "task.goal", "zebra-zero reaches"),
        ("policy.toml", "'torqe'", "q-learning, omniscient, torque"),
        ("document.toml", "small.toml", "JSON"),
        ("memory.toml", "perception.memory = 'nowhere.json'", "a readable file"),
        ("programmed.toml", "learning.programmed = 'nowhere'", "a state of this task"),
        ("million.toml", "1000000 cells of 10 trials in runs/million, about 80.0 GB", "only with --yes"),
        ("billion.toml --yes", "11000000 cells", "at most 10000000"),
        ("small.toml --engine threads", "engine = 'threads'", "sequential, processes, dask"),
        ("small.toml --jobs -1", "jobs = -1", "from 0 to"),
        ("small.toml --engine processes --scheduler x", "engine = 'processes'", "dask"),
        ("small.toml --scheduler 127.0.0.1:1", "scheduler = '127.0.0.1:1'", "a Dask scheduler that answers"),
        ("small.toml --scheduler tcp://nowhere.invalid:8786", "nowhere.invalid", "a Dask scheduler that answers"),
        ("small.toml --scheduler 127.0.0.1:x", "scheduler = '127.0.0.1:x'", "a Dask scheduler that answers"),
        ("small.toml --out small.toml", "small.toml", "name another folder"),
        ("small.toml --out other", "other: holds something already", "name another folder"),
        ("small.toml --jbos 2", "--jbos", "did you mean --jobs?"),
    ],
)
def test_what_cannot_be_used_is_named_in_one_line(
    desk: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    words: str,
    named: str,
    accepted: str,
) -> None:
    monkeypatch.chdir(desk)
    line = refused_here(f"study {words}", desk, capsys)
    assert named in line
    assert accepted in line


@pytest.mark.parametrize(
    ("old", "new", "named"),
    [
        ("trials = 2", "trials = 3", "study.trials = 3"),
        ("0.3", "0.4", "base.task.time_limit_s = 0.4"),
        ("[0, 1]", "[1, 2]", "a study may grow, not shrink"),
    ],
)
def test_the_folder_of_another_study_is_refused_and_left(
    done: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], old: str, new: str, named: str
) -> None:
    (tmp_path / "other.toml").write_text(SMALL.replace(old, new))
    before = files_in(done)
    assert named in refused_here(f"study {tmp_path}/other.toml --out {done}", tmp_path, capsys)
    assert files_in(done) == before


class Terminal(io.StringIO):
    """Somebody who types."""

    def isatty(self) -> bool:
        return True


@pytest.mark.parametrize(("answer", "code"), [("y\n", 0), ("\n", 2), ("", 2)])
def test_a_large_study_is_asked_about(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], answer: str, code: int
) -> None:
    monkeypatch.setattr("palpate.adapters.cli.study._MANY", 0)
    monkeypatch.setattr(sys, "stdin", Terminal(answer))
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True, raising=False)
    text = SMALL.replace("[0, 1]", "[0]").replace('"q-learning", ', "")
    assert run(text, tmp_path / "out", "--engine", "sequential") == code
    assert "begin? [y/N]" in capsys.readouterr().err
    assert (tmp_path / "out").exists() == (code == 0)


def test_help_shows_a_study_file() -> None:
    printed = succeed("study", "--help")
    for word in ("[study]", "[grid]", "[[cells]]", "--engine", "--scheduler", "--jobs", "--yes", "--out"):
        assert word in printed
