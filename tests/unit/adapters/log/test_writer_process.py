"""The writer process, as a class and as a process: whatever happens, a log is closed soundly or said not to be."""

import json
import shutil
import subprocess
import sys
from io import BytesIO
from pathlib import Path

import pytest

from palpate.adapters.log import RawMessage, TickRecord, read_log
from palpate.adapters.log import writer_process as module
from palpate.adapters.log.file import describe_channels
from palpate.adapters.log.writer_process import CLOSE, OPEN, QUIT, frame, message_frame, serve
from tests.unit.adapters.log.crafted import log_bytes, messages, tick_record


def opening(path: Path) -> bytes:
    return frame(OPEN, json.dumps({"path": str(path), "metadata": {"schema": "palpate.log/2"}}).encode())


HEAD = frame(OPEN, json.dumps(describe_channels()).encode())


def frames_of(content: list[RawMessage]) -> bytes:
    return b"".join(message_frame(m.channel, m.time_ns, m.payload) for m in content)


def write(data: bytes) -> list[tuple[str, str]]:
    """What the writer reports of these frames."""
    reports: list[tuple[str, str]] = []
    serve(BytesIO(data), lambda path, problem, **_: reports.append((path, problem)))
    return [(path, problem) for path, problem in reports if problem]


def test_the_process_loads_no_more_than_it_writes_with() -> None:
    program = "import sys, palpate.adapters.log.writer_process; sys.exit(len({'numpy', 'google'} & set(sys.modules)))"
    assert subprocess.run([sys.executable, "-c", program], check=False).returncode == 0


def test_logs_one_after_the_other(tmp_path: Path) -> None:
    one, two = tmp_path / "1.mcap", tmp_path / "2.mcap"
    trial = frames_of(messages())
    assert write(HEAD + opening(one) + trial + frame(CLOSE) + opening(two) + trial + frame(CLOSE) + frame(QUIT)) == []
    assert one.read_bytes() == two.read_bytes() == log_bytes()
    assert sorted(p.name for p in tmp_path.iterdir()) == ["1.mcap", "2.mcap"]


@pytest.mark.parametrize("cut", [0, 1, 10, 13, 14, 200])
def test_input_that_breaks_off_closes_the_log_soundly(tmp_path: Path, cut: int) -> None:
    path = tmp_path / "1.mcap"
    data = HEAD + opening(path) + frames_of(messages())
    assert write(data[: len(data) - cut]) == []
    assert [r.tick for r in read_log(path).records()] == list(range(39 if cut == 200 else 40))


def test_a_log_that_cannot_be_packed_does_not_end_the_writer(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    one, two = tmp_path / "1.mcap", tmp_path / "2.mcap"
    add = module.LogFile.add

    def failing(log: module.LogFile, channel: int, time_ns: int, payload: bytes) -> None:
        if log.messages == 30 and not two.exists():
            raise ValueError("odd")
        add(log, channel, time_ns, payload)

    monkeypatch.setattr(module.LogFile, "add", failing)
    trial = frames_of(messages())
    reports = write(HEAD + opening(one) + trial + opening(two) + trial)
    assert reports == [(str(one), "cannot be written (odd); nothing after that is kept")]
    assert two.read_bytes() == log_bytes()


FULL = """
import subprocess, sys
from pathlib import Path
from palpate.adapters.log.writer_process import serve
room, data, out = sys.argv[1:4]
disk = Path(sys.argv[4])
subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={room}", "tmpfs", str(disk)], check=True)
reports = []
serve(open(data, "rb"), lambda path, problem, **_: reports.append(problem))
print([problem for problem in reports if problem])
Path(out).write_bytes((disk / "1.mcap").read_bytes())
left = sorted(p.name for p in disk.iterdir())
print(left)
"""


def on_a_small_disk(tmp_path: Path, room: int, ticks: int) -> tuple[list[str], Path]:
    """A log of so many ticks, written to a real disk of so many bytes; mounted for that process alone."""
    if shutil.which("unshare") is None or subprocess.run(["unshare", "-rm", "true"], capture_output=True).returncode:
        pytest.skip("this machine does not let a test mount a disk")
    disk, data, out = tmp_path / "disk", tmp_path / "frames", tmp_path / "out.mcap"
    disk.mkdir()
    data.write_bytes(HEAD + opening(disk / "1.mcap") + frames_of(messages(range(ticks))) + frame(CLOSE))
    command = ["unshare", "-rm", sys.executable, "-c", FULL, str(room), str(data), str(out), str(disk)]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    reports, left = done.stdout.splitlines()
    assert left == "['1.mcap']"
    return [reports], out


def test_a_real_disk_that_fills_ends_the_log_soundly_with_a_mark(tmp_path: Path) -> None:
    reports, out = on_a_small_disk(tmp_path, 400 << 10, 4000)
    assert reports == ["['cannot be written (No space left on device); nothing after that is kept']"]
    log = read_log(out)
    records: list[TickRecord] = list(log.records())
    assert records == [tick_record(k) for k in range(len(records))]
    assert 500 < len(records) < 4000
    assert log.end is None
    (mark,) = log.losses
    assert mark.problem == "cannot be written (No space left on device)"
    assert mark.tick == records[-1].tick


def test_a_real_disk_that_fills_with_the_last_chunk_loses_nothing(tmp_path: Path) -> None:
    ticks = 1000
    whole = len(log_bytes(messages(range(ticks))))
    # The chunks fit beside the reserve, the index does not.
    room = (whole - 2000 + (256 << 10)) // 4096 * 4096
    reports, out = on_a_small_disk(tmp_path, room, ticks)
    assert reports == ["['cannot be written (No space left on device); the reserve took its end']"]
    assert out.read_bytes() == log_bytes(messages(range(ticks)))
