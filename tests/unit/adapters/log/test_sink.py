"""Logs as files: whatever happens to disk or run, what was written is readable, and nothing is overwritten."""

import errno
import os
import signal
import subprocess
import sys
import threading
import time
from functools import partial
from io import FileIO
from pathlib import Path
from typing import Any

import pytest

from palpate.adapters.log import FileSink, message_record, read_log
from palpate.adapters.log import sink as module
from tests.unit.adapters.log.crafted import SMALL, log_bytes, messages
from tests.unit.adapters.log.recording_bench import Bench, ticks_of

FACTS = {"schema": "palpate.log/2"}


def written(sink: FileSink, path: Path) -> str:
    """Write a small log; the trouble with it."""
    sink.open(path, FACTS)
    sink.put(lambda: b"".join(map(message_record, SMALL)))
    sink.close()
    return sink.trouble() or ""


def test_a_log_is_whole_when_it_is_closed(tmp_path: Path) -> None:
    sink = FileSink()
    for number in range(3):
        assert written(sink, tmp_path / "new" / f"{number}.mcap") == ""
        assert (tmp_path / "new" / f"{number}.mcap").read_bytes() == log_bytes(SMALL)
    sink.shut()
    sink.shut()
    assert not [thread for thread in threading.enumerate() if thread.name == "log writer"]


def test_a_file_that_is_there_is_not_overwritten(tmp_path: Path) -> None:
    (tmp_path / "a.mcap").write_bytes(b"precious")
    (tmp_path / "link.mcap").symlink_to(tmp_path / "nowhere")
    sink = FileSink()
    for name in ("a.mcap", "link.mcap"):
        assert written(sink, tmp_path / name) == (
            f"{tmp_path / name}: cannot be written (File exists); nothing after that is kept"
        )
    assert written(sink, tmp_path / "b.mcap") == ""
    sink.shut()
    assert (tmp_path / "a.mcap").read_bytes() == b"precious"
    assert sorted(os.listdir(tmp_path)) == ["a.mcap", "b.mcap", "link.mcap"]


@pytest.mark.parametrize("room", [0, 100, 4000, 8000, 9000])
def test_a_full_disk_costs_only_what_came_after(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, room: int) -> None:
    write, left = module._write, [room]

    def full(self: FileIO, data: Any) -> int:
        if not left[0]:
            raise OSError(errno.ENOSPC, "No space left on device")
        done = write(self, data[: left[0]])
        left[0] -= done
        return done

    monkeypatch.setattr(module, "_write", full)
    sink, path, content = FileSink(), tmp_path / "a.mcap", messages(range(100))
    sink.open(path, FACTS)
    for message in content:
        sink.put(partial(message_record, message))
    sink.close()
    assert "cannot be written (No space left on device)" in (sink.trouble() or "")
    assert sink.trouble() is None
    left[0] = 1 << 30
    assert written(sink, tmp_path / "b.mcap") == ""
    sink.shut()
    assert path.stat().st_size <= room
    if room >= 8000:
        log = read_log(path)
        assert ticks_of(log) == list(range(len(log.ticks)))
        assert "footer" in log.damage


def test_a_disk_that_hangs_does_not_hold_up_the_loop(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    hung = threading.Event()
    monkeypatch.setattr(module, "_write", lambda file, data: hung.wait(60.0) and FileIO.write(file, data))
    sink = FileSink(patience_s=0.05)
    bench = Bench(sink)
    began = time.monotonic()
    bench.begin(tmp_path / "a.mcap")
    bench.run(200)
    bench.end()
    assert time.monotonic() - began < 20.0
    assert bench.recorder.troubles == [f"{tmp_path / 'a.mcap'}: its end was not written within 0.05 s"]
    hung.set()
    sink.shut()


LOOP = """
import sys, time
from pathlib import Path
from palpate.adapters.log import FileSink
from tests.unit.adapters.log.recording_bench import Bench
bench = Bench(FileSink())
bench.begin(Path(sys.argv[1]))
bench.run(100)
time.sleep(0.2)
print("ready", flush=True)
time.sleep(100)
"""


def test_a_run_that_is_killed_leaves_a_readable_log(tmp_path: Path) -> None:
    path = tmp_path / "1.mcap"
    with subprocess.Popen([sys.executable, "-c", LOOP, str(path)], stdout=subprocess.PIPE) as child:
        assert child.stdout is not None
        assert child.stdout.readline() == b"ready\n"
        os.kill(child.pid, signal.SIGKILL)
    log = read_log(path)
    assert ticks_of(log) == list(range(len(log.ticks)))
    assert 100 - 35 <= len(log.ticks) <= 100
    assert log.end is None
    assert "the file ends without its footer" in log.damage
    assert os.listdir(tmp_path) == ["1.mcap"]
