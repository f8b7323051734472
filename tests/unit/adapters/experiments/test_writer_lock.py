"""A folder has one writer; one that crashed is told of and blocks nobody, unless another host's cannot be asked."""

import os
import signal
import socket
import subprocess
import sys

import pytest

from palpate.adapters.experiments.writer_lock import LOCK, only_writer
from palpate.core.errors import OutputError

HOLDER = """
import sys, time
from pathlib import Path
from palpate.adapters.experiments.writer_lock import only_writer
with only_writer(Path(sys.argv[1])):
    print("mine", flush=True)
    time.sleep(60)
"""


def holder(folder):
    """Another process that writes into the folder."""
    process = subprocess.Popen([sys.executable, "-c", HOLDER, str(folder)], stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    assert process.stdout.readline() == "mine\n"
    return process


def test_a_second_writer_is_refused_and_told_whose_it_is(tmp_path):
    other = holder(tmp_path)
    try:
        with pytest.raises(OutputError) as told, only_writer(tmp_path):
            pass
    finally:
        other.kill()
        other.communicate()
    line = str(told.value)
    assert f"is being written by process {other.pid} on {socket.gethostname()} since 20" in line
    assert str(tmp_path) in line


def test_a_writer_that_was_killed_blocks_nobody_and_is_told_of(tmp_path):
    other = holder(tmp_path)
    os.kill(other.pid, signal.SIGKILL)
    other.communicate()
    with only_writer(tmp_path) as before:
        assert before.startswith(f"process {other.pid} on {socket.gethostname()} since 20")
    assert not (tmp_path / LOCK).exists()
    with only_writer(tmp_path) as before:
        assert before == ""


def test_a_lock_of_another_host_is_a_persons_affair(tmp_path):
    (tmp_path / LOCK).write_text("process 7 on elsewhere since 2026-01-01 00:00:00 UTC: palpate train\n")
    with pytest.raises(OutputError, match=r"process 7 on elsewhere since 2026-01-01.*take away"), only_writer(tmp_path):
        pass
    (tmp_path / LOCK).unlink()
    with only_writer(tmp_path):
        pass
