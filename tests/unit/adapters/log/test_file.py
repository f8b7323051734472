"""How a log grows on disk: by chunks of trial time, into a file that was not there before, on a disk that may fill."""

import errno
import os
from io import BytesIO
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.reader import make_reader
from mcap.records import Chunk

from palpate.adapters.log import EVENT
from palpate.adapters.log import file as module
from palpate.adapters.log.container import ChannelMap, RawMessage, outer_records, require_mcap
from palpate.adapters.log.file import CHUNK_BYTES, CHUNK_NS, LogFile, NewFile, describe_channels
from tests.unit.adapters.log.crafted import log_bytes, messages


def chunks(data: bytes) -> list[tuple[Chunk, list[RawMessage]]]:
    channels, found = ChannelMap("x"), []
    for opcode, at, body in outer_records("x", data, require_mcap("x", data)):
        if opcode == Opcode.CHUNK:
            chunk = Chunk.read(ReadDataStream(BytesIO(body)))
            found.append((chunk, list(channels.messages(opcode, at, body))))
    return found


def test_a_chunk_spans_less_than_a_quarter_second_of_trial_time() -> None:
    content = messages(range(400))
    found = chunks(log_bytes(content))
    assert [m for _, inside in found for m in inside] == content
    for chunk, inside in found:
        assert inside[-1].time_ns - inside[0].time_ns < CHUNK_NS
        assert (chunk.message_start_time, chunk.message_end_time) == (inside[0].time_ns, inside[-1].time_ns)
    for (_, before), (_, after) in pairwise(found[1:]):
        assert after[0].time_ns - before[0].time_ns >= CHUNK_NS


def test_what_is_older_than_a_chunk_is_on_disk() -> None:
    stream = BytesIO()
    log = LogFile(stream, describe_channels(), {})
    for number, message in enumerate(content := messages(range(150))):
        log.add(message.channel, message.time_ns, message.payload)
        on_disk = [m for _, inside in chunks(stream.getvalue()) for m in inside]
        assert on_disk == content[: len(on_disk)]
        missing = content[len(on_disk) : number + 1]
        assert all(message.time_ns - m.time_ns < CHUNK_NS for m in missing)
        assert number or on_disk == content[:1]


def test_times_before_zero_backwards_and_far_apart_do_not_matter() -> None:
    times = [-5, 0, 10**18, 3, 3, 10**15, 2]
    content = [RawMessage(EVENT.id, time, b"") for time in times]
    found = [m.time_ns for _, inside in chunks(log_bytes(content)) for m in inside]
    assert found == [max(time, 0) for time in times]


def test_a_chunk_ends_by_its_size_where_time_stands_still() -> None:
    content = [RawMessage(EVENT.id, 0, bytes([k]) * 100_000) for k in range(40)]
    assert all(chunk.uncompressed_size <= CHUNK_BYTES + 110_000 for chunk, _ in chunks(log_bytes(content)))


def test_other_tools_see_topics_and_metadata() -> None:
    reader = make_reader(BytesIO(log_bytes()), validate_crcs=True)
    summary = reader.get_summary()
    assert summary is not None
    assert {channel.topic for channel in summary.channels.values()} >= {"/start", "/tick", "/end"}
    assert all(channel.metadata["about"] for channel in summary.channels.values())
    assert [record.metadata for record in reader.iter_metadata()] == [{"schema": "palpate.log/2"}]
    assert len(list(reader.iter_messages(topics="/tick"))) == 40


def test_a_new_file_is_new(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    path.write_bytes(b"precious")
    with pytest.raises(FileExistsError):
        NewFile(path)
    (tmp_path / "link").symlink_to(tmp_path / "nowhere")
    with pytest.raises(FileExistsError):
        NewFile(tmp_path / "link", 100)
    assert path.read_bytes() == b"precious"
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a.mcap", "link"]


def test_what_is_written_is_there_at_once_and_the_reserve_leaves_no_trace(tmp_path: Path) -> None:
    file = NewFile(tmp_path / "a.mcap", 1000)
    assert file.write(b"abc") == 3
    assert (tmp_path / "a.mcap").read_bytes() == b"abc"
    assert [p.name for p in tmp_path.iterdir()] == ["a.mcap"]
    assert file.tell() == 3
    file.close()
    file.close()
    assert file.trouble is None


class Disk:
    """A disk with so much room left, of which a reserve takes and gives."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, room: int) -> None:
        self.room, self._write, self._truncate = room, os.write, os.ftruncate
        monkeypatch.setattr(module.os, "write", self.write)
        monkeypatch.setattr(module.os, "ftruncate", self.truncate)
        monkeypatch.setattr(module, "TemporaryFile", self.reserve)

    def write(self, fd: int, data: Any) -> int:
        if self.room <= 0:
            raise OSError(errno.ENOSPC, "No space left on device")
        done = self._write(fd, data[: self.room])
        self.room -= done
        return done

    def truncate(self, fd: int, size: int) -> None:
        self.room += os.fstat(fd).st_size - size
        self._truncate(fd, size)

    def reserve(self, **_: Any) -> Any:
        disk = self

        class Reserve:
            size = 0

            def write(self, data: bytes) -> int:
                if disk.room < len(data):
                    raise OSError(errno.ENOSPC, "No space left on device")
                disk.room, self.size = disk.room - len(data), self.size + len(data)
                return len(data)

            def close(self) -> None:
                disk.room, self.size = disk.room + self.size, 0

        return Reserve()


def test_a_full_disk_costs_the_reserve_and_nothing_that_was_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    disk = Disk(monkeypatch, 150)
    file = NewFile(tmp_path / "a", 100)
    file.write(b"a" * 30)
    assert file.trouble is None
    file.write(b"b" * 40)
    assert file.trouble == "cannot be written (No space left on device)"
    assert (tmp_path / "a").read_bytes() == b"a" * 30 + b"b" * 40
    assert disk.room == 80
    with pytest.raises(OSError, match="No space"):
        file.write(b"c" * 81)
    assert (tmp_path / "a").read_bytes() == b"a" * 30 + b"b" * 40
    file.write(b"d" * 80)
    assert file.tell() == 150
    file.close()


def test_a_reserve_that_is_too_small_leaves_the_file_as_it_was(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    Disk(monkeypatch, 110)
    file = NewFile(tmp_path / "a", 100)
    file.write(b"a" * 5)
    with pytest.raises(OSError, match="No space"):
        file.write(b"b" * 200)
    assert (tmp_path / "a").read_bytes() == b"a" * 5
    file.close()
