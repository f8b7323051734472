"""The pipe to the writer process: never waited for in the loop, never hung on, nothing left behind."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from palpate.adapters.log import Opening, ProcessSink, message_frame, read_log
from palpate.adapters.log import writer_client as module
from palpate.adapters.signals import ENDING
from palpate.core.errors import DeviceError, OutputError
from tests.support.memory_sink import MemorySink
from tests.unit.adapters.log.crafted import log_bytes, messages
from tests.unit.adapters.log.recording_bench import Bench, ticks_of

FRAMES = b"".join(message_frame(m.channel, m.time_ns, m.payload) for m in messages())


@pytest.fixture
def sink() -> Iterator[ProcessSink]:
    made = ProcessSink(queue_bytes=1 << 20, patient=True)
    yield made
    made.shut()


def open_files() -> set[str]:
    return {entry.name for entry in Path("/proc/self/fd").iterdir()}


def stopped(sink: ProcessSink, path: Path) -> None:
    """Open a log, and let the writer sleep."""
    sink.open(Opening(path, {}))
    os.kill(sink.process_id, signal.SIGSTOP)
    # On a busy machine it may go on for a while; its state is the third word, after a name in brackets.
    while Path(f"/proc/{sink.process_id}/stat").read_text().rpartition(")")[2].split()[0] != "T":
        time.sleep(0.001)


def wake(sink: ProcessSink) -> None:
    os.kill(sink.process_id, signal.SIGCONT)


def kill(sink: ProcessSink) -> None:
    os.kill(sink.process_id, signal.SIGKILL)
    os.waitid(os.P_PID, sink.process_id, os.WEXITED | os.WNOWAIT)


def test_memory_and_process_write_the_same_bytes(tmp_path: Path, sink: ProcessSink) -> None:
    memory, opening = MemorySink(), Opening(tmp_path / "1.mcap", {"schema": "palpate.log/2"})
    for each in (memory, sink):
        each.open(opening)
        assert each.put(FRAMES[:0])
        each.close(FRAMES)
        assert each.shut() is None
        assert each.trouble() is None
    assert opening.path.read_bytes() == memory.logs[0] == log_bytes()


def test_shutting_leaves_no_process_and_no_open_file(tmp_path: Path) -> None:
    before = open_files()
    sink = ProcessSink(queue_bytes=1 << 20, patient=True)
    sink.open(Opening(tmp_path / "1.mcap", {}))
    assert sink.shut() is None
    assert sink.shut() is None
    assert open_files() == before
    with pytest.raises(ChildProcessError):
        os.waitpid(sink.process_id, 0)


def test_what_comes_after_shutting_goes_nowhere(tmp_path: Path) -> None:
    sink = ProcessSink(queue_bytes=1 << 20, patient=True)
    assert sink.shut() is None
    # Whoever is given the numbers of the pipes next is neither written to nor read from.
    files = [(tmp_path / str(k)).open("w+b", buffering=0) for k in range(8)]
    for file in files:
        file.write(b"mine")
        file.seek(0)
    sink.open(Opening(tmp_path / "1.mcap", {}))
    assert not sink.put(FRAMES)
    sink.close(FRAMES)
    assert sink.trouble() == f"{tmp_path / '1.mcap'}: is not recorded, because the log writer is gone"
    assert [file.read() for file in files] == [b"mine"] * 8
    for file in files:
        file.close()


def test_a_writer_that_cannot_run_is_told_before_anything_is_lost(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module.sys, "executable", "/bin/false")
    sink = ProcessSink(queue_bytes=1 << 20, patient=True)
    with pytest.raises(OutputError, match="log writer: does not start"):
        sink.open(Opening(tmp_path / "1.mcap", {}))
    sink.shut()
    monkeypatch.setattr(module.sys, "executable", str(tmp_path / "none"))
    with pytest.raises(FileNotFoundError, match="none"):
        ProcessSink(queue_bytes=1 << 20, patient=True)


def test_modules_in_the_working_folder_do_not_get_in_the_way(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "struct.py").write_text("raise SystemExit(1)")
    monkeypatch.chdir(tmp_path)
    sink = ProcessSink(queue_bytes=1 << 20, patient=True)
    sink.open(Opening(Path("1.mcap"), {}))
    monkeypatch.undo()
    sink.close(FRAMES)
    assert sink.shut() is None
    assert len(read_log(tmp_path / "1.mcap").ticks) == 40


def test_a_full_queue_refuses_and_keeps_what_it_has(tmp_path: Path) -> None:
    sink = ProcessSink(queue_bytes=50_000, patient=False)
    stopped(sink, tmp_path / "1.mcap")
    assert sink.put(FRAMES)
    taken = [sink.put(message_frame(6, 0, bytes(9000))) for _ in range(300)]
    assert taken[0]
    assert not taken[-1]
    assert taken == sorted(taken, reverse=True)
    assert sink.put(message_frame(6, 0, bytes(100_000)), vital=True)
    wake(sink)
    sink.close(b"")
    assert sink.shut() is None
    assert (tmp_path / "1.mcap").stat().st_size > 0


def test_an_empty_queue_takes_more_than_its_size(tmp_path: Path, sink: ProcessSink) -> None:
    small = ProcessSink(queue_bytes=10, patient=False)
    small.open(Opening(tmp_path / "1.mcap", {"schema": "palpate.log/2"}))
    assert small.put(FRAMES)
    small.close(b"")
    assert small.shut() is None
    assert (tmp_path / "1.mcap").read_bytes() == log_bytes()


def test_with_patience_nothing_is_lost(tmp_path: Path) -> None:
    sink = ProcessSink(queue_bytes=1000, patient=True)
    bench = Bench(sink)
    bench.begin(tmp_path / "1.mcap")
    bench.run(15_000)  # more than pipe and queue hold
    bench.end()
    assert sink.shut() is None
    assert (bench.recorder.troubles, bench.recorder.dropped_messages) == ([], 0)
    assert ticks_of(read_log(tmp_path / "1.mcap")) == list(range(15_000))


@pytest.mark.parametrize("patient", [True, False])
def test_a_writer_that_is_killed_is_reported_once_and_ends_the_trial(tmp_path: Path, patient: bool) -> None:
    sink = ProcessSink(queue_bytes=16_000, patient=patient)
    bench = Bench(sink)
    bench.begin(tmp_path / "1.mcap")
    bench.run(100)
    path = tmp_path / "1.mcap"
    while not path.exists():
        time.sleep(0.01)
    kill(sink)
    with pytest.raises(DeviceError, match="the log writer is gone"):
        bench.run(10_000)
    bench.end()
    assert bench.recorder.troubles == [f"{path}: the log writer is gone (Broken pipe)"]
    bench.begin(tmp_path / "2.mcap")
    assert bench.recorder.troubles[1:] == [f"{tmp_path / '2.mcap'}: is not recorded, because the log writer is gone"]
    assert sink.shut() is None
    assert [entry.name for entry in tmp_path.iterdir()] == ["1.mcap"]  # the reserve is gone with its writer


def test_a_writer_that_takes_nothing_is_given_up(tmp_path: Path) -> None:
    sink = ProcessSink(queue_bytes=16_000, patient=True, patience_s=0.2)
    stopped(sink, tmp_path / "1.mcap")
    while sink.put(bytes(100_000)):
        pass
    assert sink.trouble() == f"{tmp_path / '1.mcap'}: the log writer has taken nothing for 0.2 s and was killed"
    sink.close(b"")
    assert sink.shut() is None


def test_a_writer_that_does_not_end_is_given_up(tmp_path: Path) -> None:
    sink = ProcessSink(queue_bytes=16_000, patient=True, patience_s=0.2)
    stopped(sink, tmp_path / "1.mcap")
    told = sink.shut()
    assert told is not None
    assert "the log writer does not end; killed after 0.2 s" in told
    assert sink.trouble() is None


def test_more_reports_than_a_pipe_holds_do_not_hang(tmp_path: Path) -> None:
    sink = ProcessSink(queue_bytes=1000, patient=True)
    for number in range(3000):
        sink.open(Opening(tmp_path / "none" / f"{number}.mcap", {}))
        sink.put(message_frame(6, 0, bytes(2000)))
    told = [sink.shut()]
    while told[-1] is not None:
        told.append(sink.trouble())
    assert len(told) == 3001


def test_signals_for_the_run_do_not_end_the_writer(tmp_path: Path, sink: ProcessSink) -> None:
    sink.open(Opening(tmp_path / "1.mcap", {"schema": "palpate.log/2"}))
    for number in ENDING:
        os.kill(sink.process_id, number)
    sink.close(FRAMES)
    assert sink.shut() is None
    assert (tmp_path / "1.mcap").read_bytes() == log_bytes()


LOOP = """
import sys, time
from pathlib import Path
from palpate.adapters.log.writer_client import ProcessSink
from tests.unit.adapters.log.recording_bench import Bench
sink = ProcessSink(queue_bytes=1 << 20, patient=True)
bench = Bench(sink)
bench.begin(Path(sys.argv[1]))
try:
    bench.run(100)
    print("ready", flush=True)
    time.sleep(100)
finally:
    sink.shut()
"""


def signalled(path: Path, number: int) -> int:
    """Run the loop, send it and all of its group a signal; returns when the writer is gone too."""
    command = [sys.executable, "-c", LOOP, str(path)]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    with subprocess.Popen(command, start_new_session=True, **pipes) as child:  # type: ignore[call-overload]
        assert child.stdout.readline() == b"ready\n", child.stderr.read()
        os.killpg(child.pid, number)
        # The writer holds it open as long as it lives.
        assert child.stderr.read() == b""
    return int(child.returncode)


def test_a_run_that_is_killed_leaves_a_sound_log(tmp_path: Path) -> None:
    assert signalled(tmp_path / "1.mcap", signal.SIGKILL) == -signal.SIGKILL
    log = read_log(tmp_path / "1.mcap")
    assert ticks_of(log) == list(range(len(log.ticks)))
    assert 100 - 14 <= len(log.ticks) <= 100
    assert log.end is None
    assert [p.name for p in tmp_path.iterdir()] == ["1.mcap"]


def test_a_fork_that_holds_the_pipe_does_not_keep_the_writer_alive(tmp_path: Path) -> None:
    sink = ProcessSink(queue_bytes=1 << 20, patient=True)
    sink.open(Opening(tmp_path / "1.mcap", {}))
    # As a pool of processes inherits it.
    holder = subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE, pass_fds=[sink._pipe])
    assert sink.shut() is None
    holder.communicate(b"\n")
