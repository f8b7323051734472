"""What a log's file holds, as other tools see it."""

from io import BytesIO
from itertools import pairwise

from mcap.reader import make_reader
from mcap.records import Chunk
from mcap.stream_reader import StreamReader

from palpate.adapters.log.container import message_record, read_messages
from palpate.adapters.log.file import LogFile
from tests.unit.adapters.log.crafted import log_bytes, messages


def test_other_tools_see_topics_and_metadata() -> None:
    reader = make_reader(BytesIO(log_bytes()), validate_crcs=True)
    summary = reader.get_summary()
    assert summary is not None
    assert {channel.topic for channel in summary.channels.values()} >= {"/start", "/tick", "/end"}
    assert all(channel.metadata["about"] for channel in summary.channels.values())
    assert [record.metadata for record in reader.iter_metadata()] == [{"schema": "palpate.log/2"}]
    assert len(list(reader.iter_messages(topics="/tick"))) == 40
    assert summary.statistics is not None
    assert summary.statistics.message_count == len(messages())
    assert sum(summary.statistics.channel_message_counts.values()) == len(messages())
    assert summary.statistics.message_end_time == messages()[-1].time_ns


def test_an_index_leads_to_a_stretch_of_time() -> None:
    found = make_reader(BytesIO(log_bytes())).iter_messages(starting_at=10**8, ending_before=2 * 10**8)
    times = [message.log_time for _, _, message in found]
    assert times == [message.time_ns for message in messages() if 10**8 <= message.time_ns < 2 * 10**8]


def test_messages_lie_in_chunks_with_checksums() -> None:
    records = list(StreamReader(BytesIO(log_bytes()), emit_chunks=True, validate_crcs=True).records)
    chunks = [record for record in records if isinstance(record, Chunk)]
    assert len(chunks) == -(-len(messages()) // 14)
    assert all(chunk.uncompressed_crc and chunk.compression == "zstd" for chunk in chunks)
    assert all(before.message_end_time <= after.message_start_time for before, after in pairwise(chunks))


def test_a_log_without_its_end_holds_all_that_was_added() -> None:
    stream = BytesIO()
    log = LogFile(stream, {})
    for number, message in enumerate(messages(), start=1):
        log.add(message_record(message))
        found, damage = read_messages("x", stream.getvalue())
        assert found == messages()[:number]
        assert "footer" in damage


def test_equal_messages_give_equal_bytes() -> None:
    assert log_bytes() == log_bytes()
