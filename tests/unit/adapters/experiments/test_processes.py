"""Worker processes end with the one that began them and die alone; a folder has one writer."""

import os
import signal
import socket
import subprocess
import sys
from concurrent.futures import BrokenExecutor
from contextlib import closing

import pytest

from palpate.adapters.experiments.executor import LocalWorkers, completed, interrupts_wait
from palpate.adapters.experiments.results import LOCK, only_writer
from palpate.core.errors import OutputError

KILLED = """
import os
from palpate.adapters.experiments import in_processes
print(list(in_processes(divmod, [(7, 2), (9, 2)], 2)), flush=True)
for _ in in_processes(divmod, [(7, 2), (9, 2)], 2):
    os.kill(os.getpid(), 9)
"""


def die(mark, interrupted=False):
    """End the worker: once where a mark says so, else always."""
    if mark is None or not mark.exists():
        if mark is not None:
            mark.touch()
        if interrupted:
            raise KeyboardInterrupt
        os.kill(os.getpid(), signal.SIGKILL)


def test_workers_do_not_outlive_a_process_that_was_killed():
    # They hold its output: reading ends with the last of them.
    done = subprocess.run([sys.executable, "-c", KILLED], stdout=subprocess.PIPE, text=True, timeout=60, check=False)
    assert (done.returncode, done.stdout) == (-signal.SIGKILL, "[(3, 1), (4, 1)]\n")


def test_process_that_is_begun_meanwhile_does_not_see_ctrl_c():
    program = "import signal; print(signal.SIGINT in signal.pthread_sigmask(signal.SIG_BLOCK, []))"
    with interrupts_wait():
        held = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert held.stdout == "True\n"
    assert signal.SIGINT not in signal.pthread_sigmask(signal.SIG_BLOCK, [])


# Others that a death interrupts run again in a pool of two.
@pytest.mark.parametrize("processes", [1, pytest.param(2, marks=pytest.mark.nightly)])
def test_call_runs_once_more_when_its_worker_died_and_no_other_call_does(tmp_path, processes):
    calls = [(None,), (tmp_path / "killed",), (tmp_path / "interrupted", True), (tmp_path,)]
    with closing(LocalWorkers(processes)) as workers:
        ends = {number: future.exception() for number, future in completed(workers, die, calls)}
    assert isinstance(ends.pop(0), BrokenExecutor)
    assert ends == {1: None, 2: None, 3: None}


HOLDER = """
import sys, time
from pathlib import Path
from palpate.adapters.experiments.results import only_writer
with only_writer(Path(sys.argv[1])):
    print("mine", flush=True)
    time.sleep(60)
"""


def holder(folder):
    """Another process that writes into the folder."""
    process = subprocess.Popen([sys.executable, "-c", HOLDER, str(folder)], stdout=subprocess.PIPE, text=True)
    assert process.stdout.readline() == "mine\n"
    return process


def test_second_writer_is_refused_and_told_whose_it_is(tmp_path):
    other = holder(tmp_path)
    try:
        with pytest.raises(OutputError) as message, only_writer(tmp_path):
            pass
    finally:
        other.kill()
        other.communicate()
    line = str(message.value)
    assert f"is being written by process {other.pid} on {socket.gethostname()} since 20" in line
    assert str(tmp_path) in line


def test_writer_that_was_killed_blocks_nobody_and_is_told_of(tmp_path):
    other = holder(tmp_path)
    os.kill(other.pid, signal.SIGKILL)
    other.communicate()
    with only_writer(tmp_path) as before:
        assert before.startswith(f"process {other.pid} on {socket.gethostname()} since 20")
    assert not (tmp_path / LOCK).exists()
    with only_writer(tmp_path) as before:
        assert before == ""
