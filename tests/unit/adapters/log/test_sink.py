"""Logs as files: whatever happens to disk or run, what was written is readable, and nothing is overwritten."""

import os
import resource
import signal
import subprocess
import sys
import threading
import time

import pytest

from palpate.adapters.log import FileSink, LogFile, LogMessage, read_log
from palpate.adapters.log import sink as module
from tests.unit.adapters.log.made_logs import STARTING, tick


def messages(ticks):
    """The messages of a trial."""
    records = [STARTING, *map(tick, range(1, ticks))]
    return [LogMessage(record, 0, place, place) for place, record in enumerate(records)]


def write(sink, path, ticks=35):
    """Write a small log; the troubles with it."""
    before = len(sink.losses)
    sink.open(path, {})
    for message in messages(ticks):
        sink.put(message)
    sink.close()
    return sink.losses[before:]


def test_log_in_a_new_folder_is_whole_once_it_is_closed_and_no_thread_stays(tmp_path):
    sink, path = FileSink(), tmp_path / "new" / "a.mcap"
    assert write(sink, path) == []
    assert not read_log(path).damage
    sink.shut()
    sink.shut()
    assert not [thread for thread in threading.enumerate() if thread.name == "log writer"]


def test_link_that_leads_nowhere_is_not_followed(tmp_path):
    (tmp_path / "link.mcap").symlink_to(tmp_path / "nowhere")
    sink = FileSink()
    trouble = f"{tmp_path / 'link.mcap'}: cannot be written (File exists); nothing after that is kept"
    assert write(sink, tmp_path / "link.mcap") == [trouble]
    sink.shut()
    assert os.listdir(tmp_path) == ["link.mcap"]


@pytest.mark.parametrize("room", [0, 100, 4000, 12000, 16000])
def test_full_disk_costs_only_what_came_after(tmp_path, room):
    sink, path = FileSink(), tmp_path / "a.mcap"
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (room, before[1]))
    try:
        (trouble,) = write(sink, path, 100)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    assert "cannot be written (File too large)" in trouble
    assert write(sink, tmp_path / "b.mcap") == []
    sink.shut()
    assert path.stat().st_size <= room
    if room >= 12000:
        log = read_log(path)
        assert [record.tick for record in log.records()] == list(range(1, len(log.ticks) + 1))
        assert "footer" in log.damage


def test_disk_that_hangs_does_not_hold_up_the_loop(tmp_path, monkeypatch):
    hung, path = threading.Event(), tmp_path / "a.mcap"

    class Hanging(LogFile):
        def add(self, *messages):
            hung.wait(60.0)

    monkeypatch.setattr(module, "LogFile", Hanging)
    sink = FileSink(timeout_s=0.05)
    began = time.monotonic()
    assert write(sink, path) == [f"{path}: its end was not written within 0.05 s"]
    assert time.monotonic() - began < 20.0
    hung.set()
    sink.shut()


LOOP = """
import sys, time
from pathlib import Path
from palpate.adapters.log import FileSink
from tests.unit.adapters.log.test_sink import messages
sink = FileSink()
sink.open(Path(sys.argv[1]), {})
for message in messages(141):
    sink.put(message)
time.sleep(0.5)
print("ready", flush=True)
time.sleep(100)
"""


def test_run_that_is_killed_leaves_a_readable_log(tmp_path):
    path = tmp_path / "1.mcap"
    with subprocess.Popen([sys.executable, "-c", LOOP, str(path)], stdout=subprocess.PIPE) as child:
        assert child.stdout.readline() == b"ready\n"
        os.kill(child.pid, signal.SIGKILL)
    log = read_log(path)
    assert [record.tick for record in log.records()] == list(range(1, 141))
    assert log.end is None
    assert "the file ends without its footer" in log.damage
    assert os.listdir(tmp_path) == ["1.mcap"]
