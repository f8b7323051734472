"""A damaged log is never misread, and whatever is wrong with it is said in one line."""

import random
import re
import struct
import zlib
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
import zstandard
from hypothesis import given
from hypothesis import strategies as st
from mcap.opcode import Opcode
from mcap.writer import MCAP0_MAGIC, CompressionType

from palpate.adapters.log import EventEntry, TrialLog, assemble, learner_of_json, read_log, reader, sound_messages
from palpate.adapters.log.messages import encode_record
from palpate.adapters.log.reader import RawMessage, outer_records
from palpate.adapters.log.schema import EVENT, START, TICK
from palpate.core.errors import LogError
from tests.unit.adapters.log.crafted import ENDING, STARTING, log_bytes, messages, rewritten, start_with, tick_record

SMALL = messages(range(6))


def read(data: bytes) -> TrialLog:
    """As :func:`read_log` reads a file, its ticks too."""
    log = assemble("x.mcap", data, list(sound_messages("x.mcap", data)))
    list(log.records())
    return log


def complaint(data: bytes) -> str:
    """What reading it is refused with."""
    with pytest.raises(LogError) as caught:
        read(data)
    text = str(caught.value)
    assert text.startswith("x.mcap: ")
    assert "\n" not in text
    assert "; " in text  # what to do comes last
    return text


def test_a_sound_log_reads_as_it_was_recorded(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    path.write_bytes(log_bytes())
    log = read_log(path)
    assert (log.path, log.size_bytes, log.start, log.end) == (str(path), path.stat().st_size, STARTING, ENDING)
    assert list(log.records()) == [tick_record(k) for k in range(40)]
    assert [decision.number for decision in log.decisions] == [0, 1]
    assert [event.name for event in log.events] == ["hole"]
    assert log.raw_bytes == sum(len(m.payload) for m in messages())


def test_a_file_that_is_not_there_or_no_file(tmp_path: Path) -> None:
    for path in (tmp_path / "none.mcap", tmp_path):
        with pytest.raises(LogError, match="cannot be read"):
            read_log(path)


@pytest.mark.parametrize(
    ("data", "expected"),
    [
        (b"", "is empty"),
        (b"\x89MCAP", "offset 0: is no MCAP file"),
        (b"tick,force\n1,2\n", "offset 0: is no MCAP file"),
        (MCAP0_MAGIC, "offset 8: the file ends without its footer"),
        (rewritten(foreign=True), "holds no messages of palpate's (written by 'other tool', profile 'other')"),
        (log_bytes([]), "holds no messages of palpate's (written by 'palpate', profile 'palpate')"),
        (log_bytes(messages(start=None)), "does not begin with what the trial started with"),
        (log_bytes(messages(start=start_with(schema="palpate.log/2"))), "has schema 'palpate.log/2'"),
        (log_bytes(SMALL) * 2, "another log begins here: two files were joined"),
        (log_bytes(SMALL) + b"x", "1 bytes follow the end of the log"),
        (log_bytes(SMALL + SMALL), "message 9: a second trial begins here"),
        (log_bytes([RawMessage(START.id, 0, b"\xff")]), "message 0: is no start of a trial"),
        (log_bytes([RawMessage(START.id, 0, b"\x0a\x0dpalpate.log/1")]), "message 0: lacks what a trial starts with"),
        (log_bytes([*SMALL, RawMessage(EVENT.id, 0, b"\xff")]), "message 9 on /event: is no Event"),
        (log_bytes([*SMALL, RawMessage(EVENT.id, 0, b"")]), "message 9 on /event: is no Event"),
        (log_bytes([*SMALL, RawMessage(TICK.id, 0, b"\xff")]), "message 6 of /tick: is no tick"),
        (log_bytes([*SMALL, RawMessage(TICK.id, 0, b"")]), "message 6 of /tick: is no tick"),
    ],
    ids=lambda value: value[:40] if isinstance(value, str) else "",
)
def test_what_is_no_log_of_one_trial_is_told_from_one(data: bytes, expected: str) -> None:
    assert expected in complaint(data)


def test_cut_at_any_byte_it_is_noticed() -> None:
    data = log_bytes(SMALL)
    for length in range(0, len(data), 5):
        assert "footer" in complaint(data[:length]) or "offset" in complaint(data[:length]) or not length


def test_with_any_bit_flipped_it_is_noticed() -> None:
    data = log_bytes(SMALL)
    for bit in random.Random(1).sample(range(8 * len(data)), 3000):
        broken = bytearray(data)
        broken[bit // 8] ^= 1 << bit % 8
        assert "x.mcap: " in complaint(bytes(broken)), bit


@given(st.binary(max_size=300))
def test_any_bytes_at_all_are_refused(noise: bytes) -> None:
    for data in (noise, MCAP0_MAGIC + noise, MCAP0_MAGIC + noise + MCAP0_MAGIC):
        with pytest.raises(LogError):
            read(data)


REWRITINGS: list[dict[str, Any]] = [
    {},
    {"compression": CompressionType.LZ4},
    {"compression": CompressionType.NONE},
    {"use_chunking": False},
    {"enable_crcs": False},
    {"enable_data_crcs": True},
    {"chunk_size": 200},
    {"use_chunking": False, "enable_crcs": False, "use_statistics": False, "use_summary_offsets": False},
]


@pytest.mark.parametrize("settings", REWRITINGS, ids=str)
def test_a_log_that_another_tool_has_rewritten_reads_the_same(settings: dict[str, Any]) -> None:
    ours, theirs = read(log_bytes()), read(rewritten(**settings))
    assert replace(theirs, size_bytes=0) == replace(ours, size_bytes=0)


def test_any_bit_flipped_under_valid_checksums_raises_nothing_else() -> None:
    # As a program with an error would write it: what checksums cannot tell, the decoding must.
    chance = random.Random(3)
    for _ in range(900):
        content = list(SMALL)
        for _ in range(chance.choice((1, 1, 3))):
            at = chance.randrange(len(content))
            payload = bytearray(content[at].payload)
            payload[chance.randrange(len(payload))] ^= 1 << chance.randrange(8)
            content[at] = content[at]._replace(payload=bytes(payload))
        with suppress(LogError):
            read(log_bytes(content))


def record(opcode: int, body: bytes) -> bytes:
    return struct.pack("<BQ", opcode, len(body)) + body


def file_of(*records: bytes) -> bytes:
    """A file without checksums of its own."""
    end = record(Opcode.DATA_END, bytes(4)) + record(Opcode.FOOTER, bytes(20))
    return MCAP0_MAGIC + b"".join(records) + end + MCAP0_MAGIC


def chunk(compression: str, data: bytes, claimed: int, crc: int = 0) -> bytes:
    name = compression.encode()
    head = struct.pack("<QQQII", 0, 0, claimed, crc, len(name)) + name
    return record(Opcode.CHUNK, head + struct.pack("<Q", len(data)) + data)


@pytest.mark.parametrize(
    ("records", "expected"),
    [
        ([chunk("zstd", zstandard.compress(bytes(10**7)), 100)], "a chunk is not as long as it claims"),
        ([chunk("zstd", zstandard.compress(b"abc"), 100)], "a chunk is not as long as it claims"),
        ([chunk("zstd", b"abc", 3)], "a chunk cannot be unpacked"),
        ([chunk("lz4", b"abc", 3)], "a chunk is not as long as it claims"),
        ([chunk("lz4", bytes(30), 3)], "a chunk cannot be unpacked"),
        ([chunk("brotli", b"abc", 3)], "a chunk cannot be unpacked (unknown compression 'brotli')"),
        ([chunk("", b"abc", 3)], "a chunk ends within a record"),
        ([chunk("", b"abc", 3, crc=1)], "the checksum of a chunk is wrong"),
        ([chunk("zstd", zstandard.compress(b"abc"), 2**40)], "claims 1099511627776 bytes, more than any log of ours"),
        ([chunk("", record(Opcode.MESSAGE, b""), 9)], "a chunk ends within a record"),
        ([record(Opcode.MESSAGE, b"abc")], "a message is shorter than its head"),
        ([record(Opcode.CHANNEL, b"abc")], "a Channel record cannot be read"),
        ([record(Opcode.CHUNK, b"abc")], "a Chunk record cannot be read"),
        ([struct.pack("<BQ", Opcode.CHUNK, 2**63)], "the file ends within a record"),
    ],
)
def test_lengths_and_sizes_that_lie_are_refused(records: list[bytes], expected: str) -> None:
    assert expected in complaint(file_of(*records))


def test_many_chunks_cannot_claim_more_than_one(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(reader, "_MOST_BYTES", 1000)
    filler = record(0x80, bytes(391))
    assert "more than any log of ours" in complaint(file_of(*[chunk("", filler, 400)] * 3))


def test_messages_of_other_tools_in_between_are_passed_over() -> None:
    content = [*SMALL[:3], RawMessage(EVENT.id, 0, encode_record("Event", EventEntry(tick=2, name="note"))), *SMALL[3:]]
    assert read(rewritten(content)).events[0].name == "note"


def test_offsets_in_complaints_are_those_of_the_file() -> None:
    data = log_bytes(SMALL)
    chunks = [(at, body) for opcode, at, body in outer_records("x", data, 8) if opcode == Opcode.CHUNK]
    at, body = chunks[1]
    broken = bytearray(data)
    broken[at + 9 + len(body) // 2] ^= 1
    found = re.search(r"offset (\d+)", complaint(bytes(broken)))
    assert found is not None
    assert int(found[1]) == at


def test_a_checksum_of_the_data_covers_what_lies_between_chunks() -> None:
    data = log_bytes(SMALL)
    at = data.index(b"palpate.log/1")  # in the metadata, which no chunk's checksum covers
    assert "the checksum of the data section is wrong" in complaint(data[:at] + b"X" + data[at + 1 :])
    assert zlib.crc32(b"") == 0


def test_a_learner_is_empty_where_nothing_learns() -> None:
    assert learner_of_json("") is None
    assert learner_of_json('{"a": 1}') == {"a": 1}
