"""Writes one log as an MCAP file, chunk by chunk."""

import struct
import zlib
from collections import Counter, defaultdict
from typing import IO, Any, Final

import zstandard
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import (
    Channel,
    Chunk,
    ChunkIndex,
    DataEnd,
    Footer,
    Header,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
    SummaryOffset,
)
from mcap.writer import MCAP0_MAGIC

from palpate.adapters.log.container import messages_in
from palpate.adapters.log.schema import CHANNELS, PACKAGE, descriptor_set

_LEVEL: Final = 1
"""Of the compression: 35 ticks are compressed in some 50 us."""
_MESSAGE_HEAD: Final = 31


class LogFile:
    """One log in the making: sound after :meth:`finish`, and without it readable up to its last chunk.

    Equal chunks give equal bytes: no wall clock enters.

    Args:
        stream: Takes bytes; what it has taken is the system's, or it raises.
        metadata: What the file tells of its trial without being decoded.
    """

    def __init__(self, stream: IO[bytes], metadata: dict[str, str]) -> None:
        self._stream, self._size, self._crc = stream, 0, 0
        self._pack = zstandard.ZstdCompressor(level=_LEVEL).compress
        self._counts: Counter[int] = Counter()
        self._chunks: list[ChunkIndex] = []
        self._channels = _bytes_of(*_schemas(), *_channels())
        self._write(MCAP0_MAGIC + _bytes_of(Header(profile="palpate", library="palpate")))
        self._metadata = MetadataIndex(name="palpate", offset=self._size, length=0)
        self._metadata.length = self._write(_bytes_of(Metadata(name="palpate", metadata=metadata)))

    def add(self, records: bytes) -> None:
        """Write messages as one chunk.

        Args:
            records: Their MCAP records.
        """
        # The first chunk says what the channels are.
        before = b"" if self._chunks else self._channels
        entries: dict[int, list[int]] = defaultdict(list)
        at = len(before)
        for message in messages_in(records):
            entries[message.channel] += (message.time_ns, at)
            self._counts[message.channel] += 1
            at += _MESSAGE_HEAD + len(message.payload)
        content = before + records
        times = [time_ns for channel in entries.values() for time_ns in channel[::2]]
        chunk = Chunk(
            compression="zstd",
            data=self._pack(content),
            message_start_time=min(times),
            message_end_time=max(times),
            uncompressed_crc=zlib.crc32(content),
            uncompressed_size=len(content),
        )
        start, packed = self._size, _bytes_of(chunk)
        indexes = {channel: _message_index(channel, entries[channel]) for channel in sorted(entries)}
        offsets, offset = {}, start + len(packed)
        for channel, index in indexes.items():
            offsets[channel] = offset
            offset += len(index)
        self._write(packed + b"".join(indexes.values()))
        self._chunks.append(
            ChunkIndex(
                message_start_time=chunk.message_start_time,
                message_end_time=chunk.message_end_time,
                chunk_start_offset=start,
                chunk_length=len(packed),
                message_index_offsets=offsets,
                message_index_length=offset - start - len(packed),
                compression=chunk.compression,
                compressed_size=len(chunk.data),
                uncompressed_size=len(content),
            )
        )

    def finish(self) -> None:
        """Write the index and the checksums."""
        self._write(_bytes_of(DataEnd(self._crc)))
        start, summary = self._size, b""
        offsets: list[SummaryOffset] = []
        for opcode, group in (
            (Opcode.SCHEMA, _schemas()),
            (Opcode.CHANNEL, _channels()),
            (Opcode.STATISTICS, [self._statistics()]),
            (Opcode.CHUNK_INDEX, self._chunks),
            (Opcode.METADATA_INDEX, [self._metadata]),
        ):
            made = _bytes_of(*group)
            offsets.append(SummaryOffset(opcode, start + len(summary), len(made)))
            summary += made
        where = start + len(summary)
        summary += _bytes_of(*offsets)
        footer = _bytes_of(Footer(summary_start=start, summary_offset_start=where, summary_crc=0))[:-4]
        crc = zlib.crc32(summary + footer)
        self._write(summary + footer + struct.pack("<I", crc) + MCAP0_MAGIC)

    def _statistics(self) -> Statistics:
        return Statistics(
            attachment_count=0,
            channel_count=len(CHANNELS),
            channel_message_counts=dict(self._counts),
            chunk_count=len(self._chunks),
            message_count=self._counts.total(),
            message_start_time=min((chunk.message_start_time for chunk in self._chunks), default=0),
            message_end_time=max((chunk.message_end_time for chunk in self._chunks), default=0),
            metadata_count=1,
            schema_count=len(CHANNELS),
        )

    def _write(self, data: bytes) -> int:
        self._stream.write(data)
        self._crc = zlib.crc32(data, self._crc)
        self._size += len(data)
        return len(data)


def _schemas() -> list[Schema]:
    return [
        Schema(id=kind.id, name=f"{PACKAGE}.{kind.message}", encoding="protobuf", data=descriptor_set(kind.message))
        for kind in CHANNELS
    ]


def _channels() -> list[Channel]:
    return [
        Channel(id=k.id, topic=k.topic, message_encoding="protobuf", metadata={"about": k.about}, schema_id=k.id)
        for k in CHANNELS
    ]


def _message_index(channel: int, entries: list[int]) -> bytes:
    """The record of where a channel's messages are in a chunk: time and offset of each."""
    size = 8 * len(entries)
    return struct.pack(f"<BQHI{len(entries)}Q", Opcode.MESSAGE_INDEX, 6 + size, channel, size, *entries)


def _bytes_of(*records: Any) -> bytes:
    builder: Any = RecordBuilder()
    for record in records:
        record.write(builder)
    return bytes(builder.end())
