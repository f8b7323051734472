"""``palpate study --scheduler``: a Dask scheduler and its workers, on loopback."""

import json
import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path
from types import SimpleNamespace

import pytest

from palpate.adapters.experiments.study import cluster
from palpate.core.errors import UsageError
from tests.command_line import STUDY, TIMEOUT_S, CommandLine, files_in

pytest.importorskip("distributed")


@pytest.fixture
def begin(tmp_path_factory):
    """Starts programs of Dask, in a folder of their own, that end with the test."""
    processes = []
    folder = tmp_path_factory.mktemp("dask")

    def start(program, *words):
        command = [sys.executable, "-m", f"distributed.cli.dask_{program}", "--no-dashboard", *words]
        with (folder / f"{program}.txt").open("ab") as message:
            processes.append(subprocess.Popen(command, cwd=folder, stdout=message, stderr=message))
        return processes[-1]

    yield start
    for process in processes:
        process.kill()
        process.wait()


@pytest.fixture
def address(begin, tmp_path_factory):
    """A scheduler's address on loopback."""
    file = tmp_path_factory.mktemp("scheduler") / "scheduler.json"
    process = begin("scheduler", "--host", "127.0.0.1", "--port", "0", "--scheduler-file", str(file))
    deadline = time.monotonic() + TIMEOUT_S
    while not (file.exists() and file.read_text().endswith("\n}")):
        assert process.poll() is None
        assert time.monotonic() < deadline
        time.sleep(0.05)
    return str(json.loads(file.read_text())["address"])


def run(out, *words):
    out.with_suffix(".toml").write_text(STUDY)
    return CommandLine()("study", out.with_suffix(".toml"), "--out", out, *words)


def kill_at_work(out, workers, killed):
    """Kill the first worker that has begun a condition."""
    deadline = time.monotonic() + TIMEOUT_S
    while not killed and time.monotonic() < deadline:
        for path in (out / "conditions").glob(".*.part"):
            number = int(path.name.split(".")[-2])
            workers[number].send_signal(signal.SIGKILL)
            killed.append(number)
            return
        time.sleep(0.002)


@pytest.mark.nightly
def test_two_workers_of_which_one_dies_leave_the_same_bytes_as_none(begin, address, studied, tmp_path, monkeypatch):
    started = [begin("worker", address, "--nthreads", "1", "--no-nanny") for _ in range(2)]
    out, killed = tmp_path / "out", list[int]()
    with monkeypatch.context() as other:
        other.setattr(cluster, "made_with", lambda: {"palpate": "9.9"})
        cluster.code_of.cache_clear()
        refused = run(out, "--scheduler", address)
        assert (refused.code, "has palpate 0.1.0, not 9.9" in refused.stderr) == (2, True)
    cluster.code_of.cache_clear()
    workers = {process.pid: process for process in started}
    hunter = threading.Thread(target=kill_at_work, args=(out, workers, killed))
    hunter.start()
    done = run(out, "--scheduler", address)
    hunter.join()
    assert len(killed) == 1
    assert done.code == 0, done
    assert "finished: 4 of 4 conditions" in done.stdout
    here, there = files_in(studied), files_in(out)
    assert here.keys() == there.keys()
    # Pictures of this process are not those of others.
    assert [name for name in here if here[name] != there[name] and not name.endswith(".png")] == []


def test_worker_with_several_threads_is_refused():
    workers = cluster.DaskWorkers.__new__(cluster.DaskWorkers)
    workers.address = "tcp://127.0.0.1:1"
    workers._client = SimpleNamespace(
        run=lambda function, on_error: {"tcp://a": function()}, nthreads=lambda: {"tcp://a": 2}
    )
    with pytest.raises(UsageError, match="has 2 threads, one is allowed"):
        workers._require_same_code()


@pytest.mark.parametrize(
    ("address", "message"),
    [
        ("tcp://127.0.0.1:1", "cannot be reached"),
        ("tls://127.0.0.1:1", "cannot be reached"),
        ("tcp://10.0.0.4:8786", "tls:// with certificates"),
        ("nowhere", "tls:// with certificates"),
    ],
)
def test_scheduler_that_cannot_be_used_is_refused(palpate, monkeypatch, address, message):
    monkeypatch.setattr(cluster, "_TIMEOUT_S", 0.5)
    Path("study.toml").write_text(STUDY)
    assert message in palpate.refusal("study", "study.toml", "--scheduler", address)
    assert not os.path.exists("runs")
