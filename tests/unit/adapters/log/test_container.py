"""A log's file: as other tools see it, cut, damaged or rewritten, and what is no log of one trial."""

import random
import struct
from contextlib import suppress
from dataclasses import replace
from io import BytesIO

import pytest
from hypothesis import given
from hypothesis import strategies as st
from mcap.opcode import Opcode
from mcap.reader import make_reader
from mcap.writer import MCAP0_MAGIC, CompressionType

from palpate.adapters.log import TICK, RawMessage, read_log
from palpate.adapters.log.container import read_messages
from palpate.adapters.log.schema import DECISION, EVENT, START
from palpate.core.errors import LogError
from tests.unit.adapters.log.made_logs import (
    ENDING,
    STARTING,
    complaint,
    log_bytes,
    messages,
    read,
    rewritten,
    start,
    tick,
)

CONTENT = messages(60)
DATA = log_bytes(CONTENT)
SMALL = messages(6)


def kept(data):
    """How many messages are read of a damaged log; each must be as it was. -1 for a log that is refused."""
    try:
        log = read(data)
    except LogError:
        return -1
    assert log.damage.startswith("offset ")
    assert "\n" not in log.damage
    count = sum(log.counts.values())
    found, _ = read_messages("x", data)
    assert found[:count] == CONTENT[:count]
    assert log.missing == ""
    return count


def test_sound_log_reads_as_it_was_recorded(tmp_path):
    path = tmp_path / "a.mcap"
    path.write_bytes(log_bytes())
    log = read_log(path)
    assert (log.path, log.size_bytes, log.start, log.end) == (str(path), path.stat().st_size, STARTING, ENDING)
    assert list(log.records()) == [tick(k) for k in range(40)]
    assert [decision.number for decision in log.decisions] == [0, 1]
    assert [event.name for event in log.events] == ["hole"]
    assert log.raw_bytes == sum(len(m.payload) for m in messages())
    assert log_bytes() == log_bytes()


def test_other_tools_see_topics_metadata_and_times():
    reader = make_reader(BytesIO(log_bytes()), validate_crcs=True)
    summary = reader.get_summary()
    assert {channel.topic for channel in summary.channels.values()} >= {"/start", "/tick", "/end"}
    assert all(channel.metadata["about"] for channel in summary.channels.values())
    assert [record.metadata for record in reader.iter_metadata()] == [{"schema": "palpate.log/4"}]
    assert len(list(reader.iter_messages(topics="/tick"))) == 40
    found = reader.iter_messages(starting_at=10**8, ending_before=2 * 10**8)
    expected = sorted(message.time_ns for message in messages() if 10**8 <= message.time_ns < 2 * 10**8)
    assert [message.log_time for _, _, message in found] == expected


@pytest.mark.parametrize("path", ["a\0b", "none.mcap"])
def test_name_that_leads_to_no_file_is_refused(path):
    with pytest.raises(LogError, match=r"cannot be read|is no file"):
        read_log(path)


def test_all_complete_chunks_of_a_cut_log_are_kept():
    counts = [kept(DATA[:length]) for length in range(0, len(DATA), 23)]
    assert counts == sorted(counts)
    assert set(counts) == {-1, *range(14, len(CONTENT), 14), len(CONTENT)}


def test_any_flipped_bit_is_found():
    counts = set()
    for bit in random.Random(1).sample(range(8 * len(DATA)), 400):
        broken = bytearray(DATA)
        broken[bit // 8] ^= 1 << bit % 8
        counts.add(kept(bytes(broken)))
    assert counts == {-1, *range(14, len(CONTENT), 14), len(CONTENT)}


@given(st.binary(max_size=300))
def test_any_other_bytes_are_refused(noise):
    for data in (noise, MCAP0_MAGIC + noise, MCAP0_MAGIC + noise + MCAP0_MAGIC):
        with pytest.raises(LogError):
            read(data)


def chunk_at(number):
    """Where a chunk of the log begins."""
    at = len(MCAP0_MAGIC)
    for _ in range(1000):
        opcode, length = struct.unpack_from("<BQ", DATA, at)
        if opcode == Opcode.CHUNK:
            number -= 1
        if number < 0:
            return at
        at += 9 + length
    raise ValueError


def test_damage_is_named():
    broken = bytearray(DATA)
    broken[chunk_at(1) + 80] ^= 1
    assert read(bytes(broken)).damage.startswith("offset ")
    assert "the recording was cut short" in read(DATA[: len(DATA) // 2]).damage
    at = DATA.index(b"palpate.log/4")  # in the metadata, outside of all chunks
    assert "crc validation failed in DataEnd" in read(DATA[:at] + b"X" + DATA[at + 1 :]).damage
    assert "checksum of the summary" in read(DATA.replace(b"log.End", b"log.Enb")).damage
    assert "bytes follow the end of the log" in read(DATA + b"x").damage


def test_false_size_of_a_chunk_is_refused():
    for claimed in (3, 2**40):
        head = struct.pack("<QQQII", 0, 0, claimed, 0, 4) + b"zstd" + struct.pack("<Q", 3) + b"abc"
        assert "contains nothing readable" in complaint(
            MCAP0_MAGIC + struct.pack("<BQ", Opcode.CHUNK, len(head)) + head
        )


@pytest.mark.parametrize(
    ("data", "expected"),
    [
        (b"", "is empty"),
        (MCAP0_MAGIC, "contains nothing readable: offset 8: the file ends without its footer"),
        (rewritten(third_party=True), "holds no messages of palpate's"),
        (log_bytes([]), "holds no messages of palpate's"),
        (log_bytes(messages(begin=None)), "does not begin with the start record"),
        (log_bytes(messages(begin=start(schema="palpate.log/3"))), "has format 'palpate.log/3'"),
        (log_bytes(SMALL + SMALL), "message 1: is a second /start"),
        (log_bytes([RawMessage(START.id, 0, b"\xff")]), "message 0: is not a start record"),
        (
            log_bytes([RawMessage(START.id, 0, b"\x0a\x0dpalpate.log/4")]),
            "message 0: lacks the start record of a trial",
        ),
        (log_bytes([*SMALL, RawMessage(EVENT.id, 0, b"\xff", 9)]), "message 9 on /event: is no Event"),
        (log_bytes([*SMALL, RawMessage(EVENT.id, 0, b"", 9)]), "message 9 on /event: is no Event"),
        (log_bytes([*SMALL, RawMessage(TICK.id, 0, b"\xff", 9)]), "message 6 of /tick: is no Tick"),
        (log_bytes([*SMALL, RawMessage(TICK.id, 0, b"", 9)]), "message 6 of /tick: is no Tick"),
    ],
    ids=lambda value: value[:40] if isinstance(value, str) else "",
)
def test_file_that_is_no_log_of_one_trial_is_refused(data, expected):
    assert expected in complaint(data)


REWRITINGS = [
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
def test_log_that_another_tool_has_rewritten_reads_the_same(settings):
    ours, theirs = read(log_bytes()), read(rewritten(**settings))
    assert replace(theirs, size_bytes=0) == replace(ours, size_bytes=0)


def test_bits_flipped_under_valid_checksums_raise_nothing_else():
    # As a program with an error would write it: what checksums cannot tell, the decoding must.
    chance = random.Random(3)
    for _ in range(500):
        content = list(SMALL)
        for _ in range(chance.choice((1, 1, 3))):
            at = chance.randrange(len(content))
            payload = bytearray(content[at].payload)
            payload[chance.randrange(len(payload))] ^= 1 << chance.randrange(8)
            content[at] = content[at]._replace(payload=bytes(payload))
        with suppress(LogError):
            read(log_bytes(content))


def test_log_sorted_by_topic_is_put_in_order_again():
    by_topic = sorted(messages(), key=lambda message: message.channel)
    for data in (log_bytes(by_topic), rewritten(by_topic)):
        assert replace(read(data), size_bytes=0) == replace(read(log_bytes()), size_bytes=0)


def test_missing_message_is_named_with_its_tick():
    content = messages()
    gone = [place for place, message in enumerate(content) if message.channel == DECISION.id]
    log = read(log_bytes(content[: gone[0]] + content[gone[0] + 1 :]))
    assert log.missing == f"message {gone[0]}, after tick 13, is missing"
    log = read(log_bytes([message for message in content if message.channel != DECISION.id]))
    assert log.missing == f"message {gone[0]}, after tick 13, is missing (and 1 more)"
    assert len(log.ticks) == 40
