"""The file around the messages: every byte of a sound one is covered by a checksum, and each checksum is checked."""

import os
import struct
import zlib
from collections.abc import Iterable, Iterator
from io import BytesIO
from pathlib import Path
from typing import Any, Final, NamedTuple

import lz4.frame  # type: ignore[import-untyped]
import zstandard
from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, DataEnd, Footer, Header
from mcap.writer import MCAP0_MAGIC

from palpate.adapters.log.schema import BY_TOPIC
from palpate.core.errors import LogError

_HEAD: Final = struct.Struct("<BQ")
_MESSAGE: Final = struct.Struct("<HIQQ")
_MESSAGE_OPCODE: Final = int(Opcode.MESSAGE)
_CHANNEL_OPCODE: Final = int(Opcode.CHANNEL)
_MOST_BYTES: Final = 1 << 29
"""What a log may hold unpacked: some three hours. A damaged or made-up file may claim any size."""
RECOVER: Final = "palpate log recover writes a sound file of what is left"


class RawMessage(NamedTuple):
    """One message as it lies in the file."""

    channel: int
    time_ns: int
    payload: bytes


def bytes_of(path: str | Path) -> bytes:
    """A log's file, whole."""
    try:
        # A pipe or a device need not have an end.
        if os.path.exists(path) and not os.path.isfile(path):
            raise LogError(str(path), "", "is no file", "name a log")
        return Path(path).read_bytes()
    except (OSError, TypeError, ValueError) as error:
        reason = getattr(error, "strerror", error)
        raise LogError(str(path), "", f"cannot be read ({reason})", "name a log that is there") from error


def require_mcap(path: str, data: bytes) -> int:
    """Make sure that this is an MCAP file at all; returns where its records begin."""
    if not data:
        raise LogError(path, "", "is empty", "nothing was recorded; delete it")
    if not data.startswith(MCAP0_MAGIC):
        raise LogError(path, "offset 0", "is no MCAP file", "name a log that palpate recorded")
    return len(MCAP0_MAGIC)


def sound_messages(path: str, data: bytes) -> Iterator[RawMessage]:
    """The messages of a sound file, every checksum checked.

    Raises:
        LogError: The file is not sound; the messages before that are not to be trusted as a whole.
    """
    offset = require_mcap(path, data)
    channels = ChannelMap(path)
    ended, summary_start = False, 0
    for opcode, start, body in outer_records(path, data, offset):
        offset = start + _HEAD.size + len(body)
        if opcode == Opcode.DATA_END and not ended:
            ended, summary_start = True, offset
            # Zero says that the file's writer made no checksum; ours does.
            expected = _decoded(path, start, DataEnd, body).data_section_crc
            if expected not in (0, zlib.crc32(data[:start])):
                raise _damaged(path, start, "the checksum of the data section is wrong")
        elif opcode == Opcode.FOOTER:
            footer = _decoded(path, start, Footer, body)
            # The checksum covers the summary and the footer up to the checksum itself, its last four bytes.
            if not ended or footer.summary_crc not in (0, zlib.crc32(data[summary_start : offset - 4])):
                raise _damaged(path, start, "the checksum of the summary is wrong")
            break
        elif not ended:
            yield from channels.messages(opcode, start, body)
    else:
        remedy = f"the recording was cut short; {RECOVER}"
        raise LogError(path, f"offset {offset}", "the file ends without its footer", remedy)
    tail = data[offset:]
    if tail[: len(MCAP0_MAGIC)] != MCAP0_MAGIC:
        raise _damaged(path, offset, "the closing magic bytes are wrong")
    rest = offset + len(MCAP0_MAGIC)
    if data[rest:].startswith(MCAP0_MAGIC):
        raise LogError(path, f"offset {rest}", "another log begins here: two files were joined", "cut it there")
    if rest != len(data):
        raise _damaged(path, rest, f"{len(data) - rest} bytes follow the end of the log")


def outer_records(path: str, data: bytes, offset: int) -> Iterator[tuple[int, int, bytes]]:
    """Opcode, offset and body of the file's records, up to the footer or the end of the data."""
    while offset < len(data):
        if offset + _HEAD.size > len(data):
            raise LogError(path, f"offset {offset}", "the file ends within a record", RECOVER)
        opcode, length = _HEAD.unpack_from(data, offset)
        end = offset + _HEAD.size + length
        if end > len(data):
            raise LogError(path, f"offset {offset}", "the file ends within a record, or is damaged here", RECOVER)
        yield opcode, offset, data[offset + _HEAD.size : end]
        if opcode == Opcode.FOOTER:
            return
        offset = end


class ChannelMap:
    """Which channel of a file is which of ours: by topic, because tools that rewrite a file number them anew."""

    def __init__(self, path: str) -> None:
        self._path = path
        self._ours: dict[int, int] = {}
        self._bytes = 0

    def messages(self, opcode: int, offset: int, body: bytes) -> Iterator[RawMessage]:
        """The messages in one record of the file: in a chunk, or by themselves."""
        if opcode == Opcode.CHUNK:
            data = self._unpacked(offset, body)
            at = 0
            while at < len(data):
                if at + _HEAD.size > len(data):
                    raise _damaged(self._path, offset, "a chunk ends within a record")
                inner, length = _HEAD.unpack_from(data, at)
                at += _HEAD.size
                if at + length > len(data) or (inner == _MESSAGE_OPCODE and length < _MESSAGE.size):
                    raise _damaged(self._path, offset, "a chunk ends within a record")
                yield from self._in_record(inner, offset, data[at : at + length])
                at += length
        else:
            yield from self._in_record(opcode, offset, body)

    def _in_record(self, opcode: int, offset: int, body: bytes) -> Iterable[RawMessage]:
        if opcode == _CHANNEL_OPCODE:
            self._learn(offset, body)
        elif opcode == _MESSAGE_OPCODE:
            if len(body) < _MESSAGE.size:
                raise _damaged(self._path, offset, "a message is shorter than its head")
            channel, _, time_ns, _ = _MESSAGE.unpack_from(body)
            if channel in self._ours:
                return (RawMessage(self._ours[channel], time_ns, body[_MESSAGE.size :]),)
        return ()

    def _learn(self, offset: int, body: bytes) -> None:
        channel = _decoded(self._path, offset, Channel, body)
        if channel.topic in BY_TOPIC and channel.message_encoding == "protobuf":
            self._ours[channel.id] = BY_TOPIC[channel.topic].id

    def _unpacked(self, offset: int, body: bytes) -> bytes:
        chunk: Chunk = _decoded(self._path, offset, Chunk, body)
        size = chunk.uncompressed_size
        self._bytes += size
        if self._bytes > _MOST_BYTES:
            raise _damaged(self._path, offset, f"a chunk claims {size} bytes, more than any log of ours holds")
        try:
            data = _decompressed(chunk)
        except Exception as error:
            # Whatever two compression libraries may raise.
            raise _damaged(self._path, offset, f"a chunk cannot be unpacked ({error})") from error
        if len(data) != size:
            raise _damaged(self._path, offset, "a chunk is not as long as it claims")
        if chunk.uncompressed_crc not in (0, zlib.crc32(data)):
            raise _damaged(self._path, offset, "the checksum of a chunk is wrong")
        return data


def _decompressed(chunk: Chunk) -> bytes:
    """Never more than one byte beyond what the chunk claims, whatever is in there."""
    most = chunk.uncompressed_size + 1
    if chunk.compression == "zstd":
        return zstandard.ZstdDecompressor().stream_reader(chunk.data).read(most)
    if chunk.compression == "lz4":
        return bytes(lz4.frame.LZ4FrameDecompressor().decompress(chunk.data, max_length=most))
    if chunk.compression == "":
        return chunk.data
    raise ValueError(f"unknown compression {chunk.compression!r}")


def writer_of(data: bytes) -> str:
    """Which program and profile the file names."""
    try:
        header = Header.read(ReadDataStream(BytesIO(data[len(MCAP0_MAGIC) + _HEAD.size :])))
    except Exception:  # whatever the library raises at bytes that are no header
        return "without a readable header"
    return f"written by {header.library!r}, profile {header.profile!r}"


def _decoded(path: str, offset: int, kind: Any, body: bytes) -> Any:
    try:
        return kind.read(ReadDataStream(BytesIO(body)))
    except Exception as error:
        raise _damaged(path, offset, f"a {kind.__name__} record cannot be read ({error})") from error


def _damaged(path: str, offset: int, problem: str) -> LogError:
    return LogError(path, f"offset {offset}", f"is damaged: {problem}", RECOVER)
