"""Only one whole trial is read for one, and whatever is wrong with it is said in one line."""

import random
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from mcap.writer import MCAP0_MAGIC, CompressionType

from palpate.adapters.log import (
    DECISION,
    EVENT,
    START,
    TICK,
    EventEntry,
    RawMessage,
    encode_record,
    learner_of_json,
    read_log,
)
from palpate.core.errors import LogError
from tests.unit.adapters.log.crafted import (
    ENDING,
    SMALL,
    STARTING,
    complaint,
    log_bytes,
    messages,
    read,
    rewritten,
    start_with,
    tick_record,
)


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
    for path, told in ((tmp_path / "none.mcap", "cannot be read"), (tmp_path, "is no file")):
        with pytest.raises(LogError, match=told):
            read_log(path)


@pytest.mark.parametrize(
    ("data", "expected"),
    [
        (b"", "is empty"),
        (b"\x89MCAP", "offset 0: is no MCAP file"),
        (b"tick,force\n1,2\n", "offset 0: is no MCAP file"),
        (MCAP0_MAGIC, "holds nothing that can be read: offset 8: the file ends without its footer"),
        (rewritten(foreign=True), "holds no messages of palpate's (written by 'other tool', profile 'other')"),
        (log_bytes([]), "holds no messages of palpate's (written by 'palpate', profile 'palpate')"),
        (log_bytes(messages(start=None)), "does not begin with what the trial started with"),
        (log_bytes(messages(start=start_with(schema="palpate.log/3"))), "has format 'palpate.log/3'"),
        (log_bytes(SMALL + SMALL), "message 1: is a second /start"),
        (log_bytes([*messages(range(6)), SMALL[-1]]), "message 9: is a second /end"),
        (log_bytes([RawMessage(START.id, 0, b"\xff")]), "message 0: is no start of a trial"),
        (log_bytes([RawMessage(START.id, 0, b"\x0a\x0dpalpate.log/2")]), "message 0: lacks what a trial starts with"),
        (log_bytes([*SMALL, RawMessage(EVENT.id, 0, b"\xff", 9)]), "message 9 on /event: is no Event"),
        (log_bytes([*SMALL, RawMessage(EVENT.id, 0, b"", 9)]), "message 9 on /event: is no Event"),
        (log_bytes([*SMALL, RawMessage(TICK.id, 0, b"\xff", 9)]), "message 6 of /tick: is no tick"),
        (log_bytes([*SMALL, RawMessage(TICK.id, 0, b"", 9)]), "message 6 of /tick: is no tick"),
    ],
    ids=lambda value: value[:40] if isinstance(value, str) else "",
)
def test_what_is_no_log_of_one_trial_is_told_from_one(data: bytes, expected: str) -> None:
    assert expected in complaint(data)


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


def test_a_log_sorted_by_topic_is_put_in_order_again() -> None:
    by_topic = sorted(messages(), key=lambda message: message.channel)
    for data in (log_bytes(by_topic), rewritten(by_topic)):
        assert replace(read(data), size_bytes=0) == replace(read(log_bytes()), size_bytes=0)


def test_a_log_of_a_tool_that_writes_no_numbers_is_read_as_it_lies() -> None:
    bare = [message._replace(sequence=0) for message in messages()]
    assert replace(read(rewritten(bare)), size_bytes=0) == replace(read(log_bytes()), size_bytes=0)


def test_a_missing_message_is_named_with_its_tick() -> None:
    content = messages()
    gone = [place for place, message in enumerate(content) if message.channel == DECISION.id]
    log = read(log_bytes(content[: gone[0]] + content[gone[0] + 1 :]))
    assert log.missing == f"message {gone[0]}, after tick 13, is missing"
    log = read(log_bytes([message for message in content if message.channel != DECISION.id]))
    assert log.missing == f"message {gone[0]}, after tick 13, is missing (and 1 more)"
    assert len(log.ticks) == 40


def test_messages_of_other_tools_in_between_are_passed_over() -> None:
    content = [*SMALL[:3], RawMessage(EVENT.id, 0, encode_record("Event", EventEntry(tick=2, name="note"))), *SMALL[3:]]
    assert read(rewritten(content)).events[0].name == "note"


def test_a_learner_is_empty_where_nothing_learns() -> None:
    assert learner_of_json("") is None
    assert learner_of_json('{"a": 1}') == {"a": 1}
