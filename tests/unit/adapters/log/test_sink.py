"""Logs as files: whatever happens to disk or run, what was written is readable, and nothing is overwritten."""

import os
import resource
import signal
import subprocess
import sys
import threading
import time

import pytest

from palpate.adapters.contracts import ContractViolation, SinkContract
from palpate.adapters.log import EndRecord, FileSink, LogFile, LogMessage, read_log
from palpate.adapters.log import sink as module
from palpate.adapters.log.container import read_messages
from palpate.adapters.log.reader import assemble
from palpate.core.errors import LogError
from tests.support.memory_sink import MemorySink
from tests.unit.adapters.log.made_logs import STARTING, tick


class OfLogs(SinkContract):
    """Batches of seven ticks; the end is in the last one."""

    def batch(self, number, *, unfit=False):
        begin = 7 * number
        records = [STARTING] if number == 0 else [tick(begin)]
        records += [tick(at) for at in range(begin + 1, begin + 7)]
        messages = [LogMessage(record, 0, begin + place, begin + place) for place, record in enumerate(records)]
        # It takes the place of a tick.
        return [*messages[:-1], messages[-1]._replace(record=EndRecord(tick=2**64))] if unfit else messages

    def kept(self, path):
        log = self.read(path)
        numbers = [0, *(record.tick // 7 for record in log.records() if record.tick % 7 == 0)]
        assert sum(log.counts.values()) == 7 * len(numbers)
        return numbers, not log.damage

    def read(self, path):
        return read_log(path)


class TestFileSink(OfLogs):
    def make(self):
        return FileSink()


class TestMemorySink(OfLogs):
    def make(self):
        self.made = self.broken()
        return self.made

    def broken(self):
        return MemorySink()

    def read(self, path):
        data = self.made.streams[path].getvalue()
        return assemble(str(path), data, *read_messages(str(path), data))


class Forgetful(MemorySink):
    def put(self, batch):
        if batch[0].tick != 14:
            super().put(batch)


class Unfinished(MemorySink):
    def shut(self):
        self._log = None
        self.streams.clear()


class OneAtATime(MemorySink):
    def open(self, path, metadata):
        if self._log is None:
            super().open(path, metadata)


class Silent(MemorySink):
    def put(self, batch):
        super().put(batch)
        self.troubles = []


class Overwriting(MemorySink):
    def open(self, path, metadata):
        self.streams.pop(path, None)
        super().open(path, metadata)


class ShutOnce(MemorySink):
    shutting = iter([None])

    def shut(self):
        next(self.shutting)


@pytest.mark.parametrize(
    ("sink", "clause"),
    [
        (Forgetful, "closed_log"),
        (Unfinished, "not_closed"),
        (OneAtATime, "next_log"),
        (Silent, "cannot_be_packed"),
        (Overwriting, "existing_log"),
        (ShutOnce, "shut_can_be"),
    ],
)
def test_each_clause_finds_a_sink_that_breaks_it(sink, clause, tmp_path):
    suite = TestMemorySink()
    suite.broken = sink  # type: ignore[method-assign]
    (name,) = [name for name in dir(suite) if name.startswith("test_") and clause in name]
    with pytest.raises((ContractViolation, LogError, KeyError, RuntimeError)):
        getattr(suite, name)(tmp_path)


def batches(ticks):
    """A trial, seven messages at a time."""
    suite = TestFileSink()
    return [suite.batch(number) for number in range(ticks // 7)]


def write(sink, path, ticks=35):
    """Write a small log; the troubles with it."""
    before = len(sink.troubles)
    sink.open(path, {})
    for batch in batches(ticks):
        sink.put(batch)
    sink.close()
    return sink.troubles[before:]


def test_no_thread_is_left():
    sink = FileSink()
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


def test_run_that_is_killed_leaves_a_readable_log(tmp_path):
    path = tmp_path / "1.mcap"
    with subprocess.Popen([sys.executable, "-c", LOOP, str(path)], stdout=subprocess.PIPE) as child:
        assert child.stdout is not None
        assert child.stdout.readline() == b"ready\n"
        os.kill(child.pid, signal.SIGKILL)
    log = read_log(path)
    assert [record.tick for record in log.records()] == list(range(1, 140))
    assert log.end is None
    assert "the file ends without its footer" in log.damage
    assert os.listdir(tmp_path) == ["1.mcap"]
