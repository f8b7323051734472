"""Logs as MCAP files, written in batches and read up to the first damaged part."""

import os
import zlib
from collections.abc import Iterable
from io import BytesIO
from pathlib import Path
from struct import Struct
from typing import IO, Any, Final, NamedTuple

from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, DataEnd, Footer, Message
from mcap.stream_reader import StreamReader, get_chunk_data_stream
from mcap.writer import MCAP0_MAGIC, Writer

from palpate.adapters.log.schema import BY_TOPIC, CHANNELS, PACKAGE, descriptor_set
from palpate.core.errors import LogError

_RECORD: Final = Struct("<BQ")
_MESSAGE: Final = Struct("<HIQQ")
"""Opcode and length of a record; channel, sequence number and two timestamps of a message. FACT: MCAP specification."""


class RawMessage(NamedTuple):
    """A message as stored in the file; ``sequence`` counts all messages in the log from 0."""

    channel: int
    time_ns: int
    payload: bytes
    sequence: int = 0


class LogFile:
    """A log written in batches; :meth:`finish` completes it. Identical batches give identical bytes."""

    def __init__(self, stream: IO[bytes], metadata: dict[str, str]) -> None:
        self._writer: Any = Writer(stream, enable_data_crcs=True)
        self._writer.start("palpate", "palpate")
        self._writer.add_metadata("palpate", metadata)
        for kind in CHANNELS:
            schema = self._writer.register_schema(f"{PACKAGE}.{kind.message}", "protobuf", descriptor_set(kind.message))
            self._writer.register_channel(kind.topic, "protobuf", schema, {"about": kind.about})

    def add(self, messages: Iterable[RawMessage]) -> None:
        """Write messages as one chunk."""
        for channel, time_ns, payload, sequence in messages:
            # The format has no negative times.
            time_ns = max(time_ns, 0)
            self._writer.add_message(channel, time_ns, payload, time_ns, sequence)
        self._writer.flush()

    def finish(self) -> None:
        """Write the index and the checksums."""
        self._writer.finish()


def bytes_of(path: str | Path) -> bytes:
    """Return a log file's bytes.

    Raises:
        LogError: The file cannot be read.
    """
    try:
        # A pipe or a device may have no end.
        if os.path.exists(path) and not os.path.isfile(path):
            raise LogError(str(path), "", "is no file", "name a log")
        return Path(path).read_bytes()
    except (OSError, TypeError, ValueError) as error:
        reason = getattr(error, "strerror", error)
        raise LogError(str(path), "", f"cannot be read ({reason})", "name an existing log") from error


def read_messages(path: str, data: bytes) -> tuple[list[RawMessage], str]:
    """Return the messages of a log up to the first damaged part, with a description of the damage.

    Messages are sorted by sequence number if the file is undamaged; otherwise they are in file order.

    Raises:
        LogError: The file is not an MCAP file.
    """
    if not data:
        raise LogError(path, "", "is empty", "nothing was recorded; delete it")
    if not data.startswith(MCAP0_MAGIC):
        raise LogError(path, "offset 0", "is not an MCAP file", "name a log that palpate recorded")
    stream, found, ours, damage = BytesIO(data), list[RawMessage](), dict[int, int](), ""
    checked = False
    try:
        for record in StreamReader(stream, emit_chunks=True, validate_crcs=True).records:
            if isinstance(record, Chunk):
                found += _in_chunk(record, ours)
            elif isinstance(record, DataEnd):
                checked = True
            elif isinstance(record, Footer):
                # The library checks only the data before the summary. A checksum of zero means that there is none.
                if record.summary_crc not in (0, zlib.crc32(data[record.summary_start : stream.tell() - 4])):
                    raise ValueError("the checksum of the summary is wrong")
            elif isinstance(record, Channel):
                _describe(record, ours)
            elif isinstance(record, Message) and record.channel_id in ours:
                found.append(RawMessage(ours[record.channel_id], record.log_time, record.data, record.sequence))
        if stream.tell() < len(data) or not checked:
            raise ValueError("the end of the data is not marked, or bytes follow the end of the log")
    # The MCAP library and its decompressors raise many types of errors for invalid bytes.
    except Exception as error:
        cut = stream.tell() == len(data)
        reason = "the file ends without its footer: the recording was cut short" if cut else error
        damage = f"offset {stream.tell()}: {reason or type(error).__name__}"
    if not damage:
        found.sort(key=lambda message: message.sequence)
    return found, damage


def _in_chunk(chunk: Chunk, ours: dict[int, int]) -> list[RawMessage]:
    """Return the messages on palpate's channels, in a third of the time that the library's own method takes."""
    stream, size = get_chunk_data_stream(chunk, validate_crc=True)
    data, at, found = stream.read(size), 0, list[RawMessage]()
    while at < size:
        opcode, length = _RECORD.unpack_from(data, at)
        begin, at = at + _RECORD.size, at + _RECORD.size + length
        if at > size:
            raise ValueError("a record of a chunk is cut short")
        if opcode == Opcode.MESSAGE:
            channel, sequence, time_ns, _ = _MESSAGE.unpack_from(data, begin)
            if channel in ours:
                found.append(RawMessage(ours[channel], time_ns, data[begin + _MESSAGE.size : at], sequence))
        elif opcode == Opcode.CHANNEL:
            _describe(Channel.read(ReadDataStream(BytesIO(data[begin:at]))), ours)
    return found


def _describe(channel: Channel, ours: dict[int, int]) -> None:
    """Map a channel to palpate's channel number by its topic, because tools that rewrite a file renumber channels."""
    if channel.topic in BY_TOPIC and channel.message_encoding == "protobuf":
        ours[channel.id] = BY_TOPIC[channel.topic].id
