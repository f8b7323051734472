"""Logs as files: whatever happens to disk or run, what was written is readable, and nothing is overwritten."""

import os
import resource
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import Any

import pytest

from palpate.adapters.log import EndRecord, FileSink, LogFile, LogMessage, read_log
from palpate.adapters.log import sink as module
from tests.unit.adapters.log.made_logs import STARTING, tick


def batches(ticks: int) -> list[list[LogMessage]]:
    """A trial, seven messages at a time."""
    records = [STARTING, *map(tick, range(ticks)), EndRecord(tick=ticks - 1)]
    messages = [LogMessage(record, 0, number, number - 1) for number, record in enumerate(records)]
    return [messages[first : first + 7] for first in range(0, len(messages), 7)]


def write(sink: FileSink, path: Path, ticks: int = 20) -> list[str]:
    """Write a small log; the troubles with it."""
    before = len(sink.troubles)
    sink.open(path, {})
    for batch in batches(ticks):
        sink.put(batch)
    sink.close()
    return sink.troubles[before:]


def test_log_is_whole_when_it_is_closed(tmp_path: Path) -> None:
    sink = FileSink()
    for number in range(3):
        path = tmp_path / "new" / f"{number}.mcap"
        assert write(sink, path) == []
        assert (read_log(path).damage, len(read_log(path).ticks)) == ("", 20)
    sink.shut()
    sink.shut()
    assert not [thread for thread in threading.enumerate() if thread.name == "log writer"]


def test_file_that_is_there_is_not_overwritten(tmp_path: Path) -> None:
    (tmp_path / "a.mcap").write_bytes(b"precious")
    (tmp_path / "link.mcap").symlink_to(tmp_path / "nowhere")
    sink = FileSink()
    for name in ("a.mcap", "link.mcap"):
        trouble = f"{tmp_path / name}: cannot be written (File exists); nothing after that is kept"
        assert write(sink, tmp_path / name) == [trouble]
    assert write(sink, tmp_path / "b.mcap") == []
    sink.shut()
    assert (tmp_path / "a.mcap").read_bytes() == b"precious"
    assert sorted(os.listdir(tmp_path)) == ["a.mcap", "b.mcap", "link.mcap"]


@pytest.mark.parametrize("room", [0, 100, 4000, 12000, 16000])
def test_full_disk_costs_only_what_came_after(tmp_path: Path, room: int) -> None:
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
        assert [record.tick for record in log.records()] == list(range(len(log.ticks)))
        assert "footer" in log.damage


def test_disk_that_hangs_does_not_hold_up_the_loop(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    hung, path = threading.Event(), tmp_path / "a.mcap"

    class Hanging(LogFile):
        def add(self, *messages: Any) -> None:
            hung.wait(60.0)

    monkeypatch.setattr(module, "LogFile", Hanging)
    sink = FileSink(patience_s=0.05)
    began = time.monotonic()
    assert write(sink, path) == [f"{path}: its end was not written within 0.05 s"]
    assert time.monotonic() - began < 20.0
    hung.set()
    sink.shut()


LOOP = """
import sys, time
from pathlib import Path
from palpate.adapters.log import FileSink
from tests.unit.adapters.log.test_sink import batches
sink = FileSink()
sink.open(Path(sys.argv[1]), {})
for batch in batches(200)[:20]:
    sink.put(batch)
time.sleep(0.5)
print("ready", flush=True)
time.sleep(100)
"""


def test_run_that_is_killed_leaves_a_readable_log(tmp_path: Path) -> None:
    path = tmp_path / "1.mcap"
    with subprocess.Popen([sys.executable, "-c", LOOP, str(path)], stdout=subprocess.PIPE) as child:
        assert child.stdout is not None
        assert child.stdout.readline() == b"ready\n"
        os.kill(child.pid, signal.SIGKILL)
    log = read_log(path)
    assert [record.tick for record in log.records()] == list(range(139))
    assert log.end is None
    assert "the file ends without its footer" in log.damage
    assert os.listdir(tmp_path) == ["1.mcap"]
