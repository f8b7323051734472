"""The MCAP records around the messages of a log, as they are read: every checksum is checked."""

import os
import struct
import zlib
from collections.abc import Iterator
from io import BytesIO
from pathlib import Path
from typing import Any, Final, NamedTuple

from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, DataEnd, Footer, Header
from mcap.stream_reader import get_chunk_data_stream
from mcap.writer import MCAP0_MAGIC

from palpate.adapters.log.schema import BY_TOPIC
from palpate.core.errors import LogError

_HEAD: Final = struct.Struct("<BQ")
_MESSAGE_BODY: Final = struct.Struct("<HIQQ")
_MESSAGE: Final = struct.Struct("<BQHIQQ")
# Members of an enumeration compare more slowly.
_OPCODE: Final = int(Opcode.MESSAGE)


class RawMessage(NamedTuple):
    """One message as it lies in the file; ``sequence`` counts all messages of the log from 0."""

    channel: int
    time_ns: int
    payload: bytes
    sequence: int = 0


def message_record(message: RawMessage) -> bytes:
    """The MCAP record of a message."""
    channel, time_ns, payload, sequence = message
    # The format has no time before zero.
    time_ns = max(time_ns, 0)
    length = _MESSAGE_BODY.size + len(payload)
    return _MESSAGE.pack(_OPCODE, length, channel, sequence, time_ns, time_ns) + payload


def messages_in(records: bytes) -> list[RawMessage]:
    """The messages of MCAP records that follow each other; a channel's description counts as a message on channel 0.

    Raises:
        ValueError: The last record is not whole.
    """
    found: list[RawMessage] = []
    at, size = 0, len(records)
    while at < size:
        if at + _HEAD.size > size:
            raise ValueError("it ends within a record")
        opcode, length = _HEAD.unpack_from(records, at)
        body = at + _HEAD.size
        at = body + length
        if at > size or (opcode == _OPCODE and length < _MESSAGE_BODY.size):
            raise ValueError("it ends within a record")
        if opcode == _OPCODE:
            channel, sequence, time_ns, _ = _MESSAGE_BODY.unpack_from(records, body)
            found.append(RawMessage(channel, time_ns, records[body + _MESSAGE_BODY.size : at], sequence))
        elif opcode == Opcode.CHANNEL:
            found.append(RawMessage(0, 0, records[body:at]))
    return found


def bytes_of(path: str | Path) -> bytes:
    """A log's file, whole.

    Raises:
        LogError: It cannot be read.
    """
    try:
        # A pipe or a device need not have an end.
        if os.path.exists(path) and not os.path.isfile(path):
            raise LogError(str(path), "", "is no file", "name a log")
        return Path(path).read_bytes()
    except (OSError, TypeError, ValueError) as error:
        reason = getattr(error, "strerror", error)
        raise LogError(str(path), "", f"cannot be read ({reason})", "name a log that is there") from error


def read_messages(path: str, data: bytes) -> tuple[list[RawMessage], str]:
    """The messages of a log in the order of their sequence numbers, up to the first damage.

    Returns:
        The messages; and the damage in words, empty for a sound file.

    Raises:
        LogError: This is no MCAP file at all.
    """
    if not data:
        raise LogError(path, "", "is empty", "nothing was recorded; delete it")
    if not data.startswith(MCAP0_MAGIC):
        raise LogError(path, "offset 0", "is no MCAP file", "name a log that palpate recorded")
    found: list[RawMessage] = []
    file = _File(data)
    damage = ""
    try:
        for messages in file.messages():
            found += messages
    # MCAP's library and those that it unpacks with raise errors of many kinds for bytes that are none of theirs.
    except Exception as error:
        damage = f"offset {file.offset}: {error or type(error).__name__}"
    found.sort(key=lambda message: message.sequence)
    return found, damage


class _File:
    """A file that is being read; ``offset`` is where the record under way begins."""

    def __init__(self, data: bytes) -> None:
        self._data = data
        self.offset = len(MCAP0_MAGIC)
        self._ours: dict[int, int] = {}

    def messages(self) -> Iterator[list[RawMessage]]:
        """Those of each chunk in front of the first damage, which is raised."""
        data = self._data
        summary_start = 0
        while True:
            start = self.offset
            if start + _HEAD.size > len(data):
                raise ValueError("the file ends without its footer: the recording was cut short")
            opcode, length = _HEAD.unpack_from(data, start)
            end = start + _HEAD.size + length
            if end > len(data):
                raise ValueError("the file ends within a record: the recording was cut short, or is damaged here")
            body = data[start + _HEAD.size : end]
            if opcode == Opcode.CHUNK and not summary_start:
                stream, size = get_chunk_data_stream(_record(Chunk, body), validate_crc=True)
                yield self._of_ours(stream.read(size))
            elif opcode in (Opcode.MESSAGE, Opcode.CHANNEL) and not summary_start:
                yield self._of_ours(data[start:end])
            elif opcode == Opcode.DATA_END:
                _require(_record(DataEnd, body).data_section_crc, data[:start], "data section")
                summary_start = end
            elif opcode == Opcode.FOOTER:
                # The footer's last four bytes are the checksum itself.
                _require(_record(Footer, body).summary_crc, data[summary_start : end - 4], "summary")
                break
            self.offset = end
        self.offset = end
        tail = data[end:]
        if not summary_start or tail[: len(MCAP0_MAGIC)] != MCAP0_MAGIC:
            raise ValueError("the end of the file is damaged")
        if len(tail) > len(MCAP0_MAGIC):
            raise ValueError(f"{len(tail) - len(MCAP0_MAGIC)} bytes follow the end of the log")

    def _of_ours(self, records: bytes) -> list[RawMessage]:
        """With our numbers of the channels: by topic, because tools that rewrite a file number them again."""
        found = []
        ours = self._ours
        for message in messages_in(records):
            channel = message.channel
            if channel == 0:
                described = _record(Channel, message.payload)
                if described.topic in BY_TOPIC and described.message_encoding == "protobuf":
                    ours[described.id] = BY_TOPIC[described.topic].id
            elif channel in ours:
                found.append(message if ours[channel] == channel else message._replace(channel=ours[channel]))
        return found


def writer_of(data: bytes) -> str:
    """The program and profile that the file names."""
    try:
        header = _record(Header, data[len(MCAP0_MAGIC) + _HEAD.size :])
    except Exception:  # whatever the library raises at bytes that are no header
        return "without a readable header"
    return f"written by {header.library!r}, profile {header.profile!r}"


def _record(kind: Any, body: bytes) -> Any:
    return kind.read(ReadDataStream(BytesIO(body)))


def _require(expected: int, data: bytes, what: str) -> None:
    """Zero says that the file's writer made no checksum; ours does."""
    if expected not in (0, zlib.crc32(data)):
        raise ValueError(f"the checksum of the {what} is wrong")
