"""``palpate study``: cells like runs of their own, on any engine, interrupted, killed, extended, never made twice."""

import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import pytest

from palpate.adapters.experiments.study.cell import StudyCell
from palpate.simulation.work_cell.cell import WorkCell
from tests.command_line import (
    PATIENCE_S,
    RESULTS,
    CommandLine,
    Done,
    Output,
    files_in,
    results_in,
    shared_folder,
    wait_until,
)

SMALL = """
[study]
trials = 2
seeds = [0, 1]
policies = ["q-learning", "torque"]
[base]
task.time_limit_s = 0.3
"""
ENDLESS = """
[study]
trials = 3
seeds = { count = 200 }
policies = ["random"]
[base]
task.time_limit_s = 0.3
"""
"""More cells than are made while a test watches."""


def run(text: str, out: Path, *words: object) -> Done:
    """Run a study in this process."""
    file = out.parent / f"{out.name}.toml"
    file.write_text(text)
    return CommandLine()("study", file, "--out", out, *words)


def make(text: str, out: Path, *words: object) -> Done:
    """Run a study in this process and on it, which must go well."""
    done = run(text, out, "--engine", "sequential", *words)
    assert done.code == 0, done
    return done


@pytest.fixture(scope="session")
def studied(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of the small study; to be read, not changed."""
    return shared_folder(tmp_path_factory, "studied", lambda out: make(SMALL, out))


def cells_in(out: Path) -> list[Path]:
    folder = out / "cells"
    return sorted(path for path in folder.iterdir() if path.suffix != ".unfinished") if folder.exists() else []


def begun_in(out: Path) -> list[Path]:
    return sorted((out / "cells").glob("*.unfinished"))


def times_in(out: Path) -> dict[str, int]:
    return {str(path.relative_to(out)): path.stat().st_mtime_ns for path in (out / "cells").rglob("*")}


def test_a_cell_is_what_train_or_run_leaves(palpate: CommandLine, studied: Path, tmp_path: Path) -> None:
    flags = ("--task.time-limit-s", 0.3, "--trials", 2, "--seed", 1, "--recording.no-enabled")
    cell = studied / "cells" / StudyCell({}, "q-learning", 1).name
    palpate.succeed("train", *flags, "--out", "trained")
    assert results_in(cell) == results_in(tmp_path / "trained")
    assert (cell / "run.toml").read_bytes() == (tmp_path / "trained" / "run.toml").read_bytes()
    assert {path.name for path in cell.iterdir()} == {*RESULTS, "run.toml", "cell.json"}
    cell = studied / "cells" / StudyCell({}, "torque", 1).name
    palpate.succeed("run", "--policy", "torque", *flags, "--out", "run")
    # Besides what says which cell it is.
    assert files_in(cell) == {**files_in(tmp_path / "run"), "cell.json": (cell / "cell.json").read_bytes()}


def test_finished_cells_are_not_made_again(palpate: CommandLine, studied: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    make(SMALL.replace("[0, 1]", "[1]"), out)
    before = times_in(out)
    assert len(cells_in(out)) == 2
    assert "2 of them are finished already" in make(SMALL, out).stdout
    assert before.items() <= times_in(out).items()
    assert files_in(out) == files_in(studied)
    # Nor with what the folder itself holds as its study.
    before = times_in(out)
    palpate.succeed("study", out / "study.toml", "--out", out, "--engine", "sequential")
    assert times_in(out) == before
    assert files_in(out) == files_in(studied)


def test_a_half_written_cell_is_announced_and_made_anew(tmp_path: Path) -> None:
    out, text = tmp_path / "out", SMALL.replace('"q-learning", ', "")
    make(text, out)
    whole = files_in(out)
    first, second = cells_in(out)
    (first / "cell.json").unlink()
    (out / "cells" / f"{first.name}.0f.unfinished").mkdir()
    untouched = second.stat().st_mtime_ns
    assert f"palpate: {first.name} was begun and not finished: it is made anew\n" in make(text, out).stderr
    assert files_in(out) == whole
    assert second.stat().st_mtime_ns == untouched


def test_a_cell_that_fails_is_named_and_the_others_are_made(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("palpate.adapters.cli.study.require_possible", lambda study: None)
    out = tmp_path / "out"
    text = SMALL.replace("[0, 1]", "[0]") + "[grid]\ntask.goal.x_mm = [400.0, 1900.0]\n"
    done = run(text, out, "--engine", "sequential")
    assert done.code == 1
    assert "2 of 4 cells are finished" in done.stdout
    assert "2 cells failed" in done.stdout
    assert done.stderr.count("failed: place = ") == 2
    assert [path.name.split("-seed")[0] for path in cells_in(out)] == ["q-learning-x_mm-400.0", "torque-x_mm-400.0"]
    assert len((out / "summary.csv").read_text().splitlines()) == 3


def _told(path: Path) -> bytes:
    """What the system says of a process or a thread; nothing once that is gone."""
    try:
        return path.read_bytes()
    except (FileNotFoundError, ProcessLookupError):
        return b""


def workers_of(pid: int) -> set[int]:
    """The worker processes of a study."""
    tasks = Path(f"/proc/{pid}/task").glob("*/children")
    children = {int(child) for task in tasks for child in _told(task).split()}
    return {child for child in children if b"resource_tracker" not in _told(Path(f"/proc/{child}/cmdline"))}


def kill_worker(out: Path, others: set[int], ended: threading.Event) -> None:
    """Kill the only worker of a study in this process as soon as it has begun a cell."""
    while not ended.wait(0.002):
        for worker in workers_of(os.getpid()) - others if begun_in(out) else ():
            with suppress(ProcessLookupError):
                os.kill(worker, signal.SIGKILL)
            return


def test_processes_leave_the_same_bytes_also_when_a_worker_is_killed(studied: Path, tmp_path: Path) -> None:
    others = workers_of(os.getpid())
    for attempt in range(10):
        out, ended = tmp_path / f"out-{attempt}", threading.Event()
        hunter = threading.Thread(target=kill_worker, args=(out, others, ended))
        hunter.start()
        done = run(SMALL, out, "--jobs", "1")
        ended.set()
        hunter.join()
        # Held up, the hunter comes when all is done.
        if "a worker died over" in done.stderr:
            break
    assert done.code == 0
    assert "a worker died over" in done.stderr
    assert "4 of 4 cells are finished" in done.stdout
    assert files_in(out) == files_in(studied)


def require_ended_in_order(done: Done, out: Path) -> None:
    assert done.code == 130
    assert "Traceback" not in done.stderr
    finished = len(cells_in(out))
    assert f"{finished} of " in done.stdout
    assert f"go on with: palpate study {out}.toml --out {out}" in done.stdout
    assert begun_in(out) == []
    assert len((out / "summary.csv").read_text().splitlines()) == 1 + finished


def test_ctrl_c_in_a_cell_keeps_what_is_finished(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    out, advance = tmp_path / "out", WorkCell.advance

    def interrupted(cell: WorkCell) -> None:
        if len(cells_in(out)) == 1 and begun_in(out):
            signal.raise_signal(signal.SIGINT)
        advance(cell)

    monkeypatch.setattr(WorkCell, "advance", interrupted)
    require_ended_in_order(run(SMALL, out, "--engine", "sequential"), out)
    assert len(cells_in(out)) == 1


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGKILL])
def test_a_study_that_is_ended_leaves_no_workers(
    tmp_path: Path, start: Callable[..., subprocess.Popen[str]], number: signal.Signals
) -> None:
    out = tmp_path / "out"
    (tmp_path / "out.toml").write_text(ENDLESS)
    process = start("study", tmp_path / "out.toml", "--out", out, "--jobs", 1)
    wait_until(lambda: bool(cells_in(out) and begun_in(out)), process)
    workers = workers_of(process.pid)
    assert workers
    process.send_signal(number)
    printed, complaint = process.communicate(timeout=PATIENCE_S)
    if number is signal.SIGINT:
        require_ended_in_order(Done(process.returncode, printed, complaint), out)
    deadline = time.monotonic() + 20.0
    while any(os.path.exists(f"/proc/{worker}") for worker in workers):
        assert number is signal.SIGKILL, "the study ended before its workers"
        assert time.monotonic() < deadline, "a worker outlives the study"
        time.sleep(0.05)


@pytest.mark.parametrize(("answer", "code"), [("y\n", 0), ("\n", 2), ("", 2)])
def test_a_large_study_is_asked_about(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, answer: str, code: int) -> None:
    monkeypatch.setattr("palpate.adapters.cli.study._MANY", 0)
    monkeypatch.setattr(sys, "stdin", Output(answer))
    monkeypatch.setattr(Output, "isatty", lambda self: True)
    text = SMALL.replace("[0, 1]", "[0]").replace('"q-learning", ', "")
    done = run(text, tmp_path / "out", "--engine", "sequential")
    assert done.code == code
    assert "begin? [y/N]" in done.stderr
    assert (tmp_path / "out").exists() == (code == 0)
