"""Makes a sound log of what is left of a torn or damaged one."""

import struct
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Final

from mcap.opcode import Opcode

from palpate.adapters.files import new_file
from palpate.adapters.log.container import ChannelMap, RawMessage, bytes_of, outer_records, require_mcap, sound_messages
from palpate.adapters.log.file import LogFile, NewFile, describe_channels, metadata_of
from palpate.adapters.log.messages import encode_record
from palpate.adapters.log.reader import TrialLog, assemble
from palpate.adapters.log.records import LossEntry
from palpate.adapters.log.schema import RECORDER
from palpate.core.errors import LogError

RECOVERED: Final = "recovered"
"""The problem that the recorder's message in a recovered log names."""

_BEFORE_CHUNKS: Final = (Opcode.HEADER, Opcode.SCHEMA, Opcode.CHANNEL, Opcode.METADATA, Opcode.ATTACHMENT)
"""Records that may stand before the first chunk. Later they are taken for a chunk whose kind is damaged."""
_INDEX_HEAD: Final = struct.Struct("<HI")
_HEAD_BYTES: Final = 9
"""Opcode and length before each record's body."""


@dataclass(frozen=True)
class Recovery:
    """What was kept of a log."""

    path: Path
    reason: str
    ticks: int
    seconds: float
    messages: int
    ended: bool
    lost_bytes: int
    size_bytes: int


def recover(path: Path, out: Path) -> Recovery | None:
    """Write a sound log of all messages before the first unsound place; None, and nothing written, for a sound one.

    Raises:
        LogError: Nothing can be kept, or it is no log of ours.
        OutputError: The new log cannot be written there.
    """
    data, name = bytes_of(path), str(path)
    try:
        whole = list(sound_messages(name, data))
    except LogError as error:
        unsound = error
    else:
        # Sound as a file, but it may be another program's, or of another schema.
        assemble(name, data, whole)
        return None
    kept, end = _sound_chunks(name, data)
    if not kept:
        problem = "nothing can be kept: it breaks off, or is damaged, before what the trial started with"
        raise LogError(name, unsound.where, problem, "it can only be deleted")
    log = assemble(name, data, kept)
    reason = str(unsound).removeprefix(f"{name}: ").split(";", 1)[0]
    _write(path, out, log, kept, reason)
    return Recovery(
        path=out,
        reason=reason,
        ticks=len(log.ticks),
        seconds=(kept[-1].time_ns - kept[0].time_ns) * 1e-9,
        messages=len(kept),
        ended=log.end is not None,
        lost_bytes=len(data) - end,
        size_bytes=len(data),
    )


def _sound_chunks(name: str, data: bytes) -> tuple[list[RawMessage], int]:
    """The messages of all chunks before the first unsound place, and where the last sound record ends.

    Only chunks count: each has a checksum of its own, and a message outside one has none.
    """
    channels, kept = ChannelMap(name), list[RawMessage]()
    end = require_mcap(name, data)
    try:
        for opcode, start, body in outer_records(name, data, end):
            if opcode == Opcode.CHUNK:
                kept += list(channels.messages(opcode, start, body))
            elif not (_is_index(opcode, body) or opcode == Opcode.DATA_END or (not kept and opcode in _BEFORE_CHUNKS)):
                break
            end = start + _HEAD_BYTES + len(body)
            if opcode == Opcode.DATA_END:
                break
    except LogError:
        # Expected: this is the unsound place. What was kept before it is all that can be trusted.
        pass
    return kept, end


def _is_index(opcode: int, body: bytes) -> bool:
    """Whether this is an index of messages, and not a chunk that a single wrong bit makes look like one."""
    if opcode != Opcode.MESSAGE_INDEX or len(body) < _INDEX_HEAD.size:
        return False
    _, length = _INDEX_HEAD.unpack_from(body)
    return bool(_INDEX_HEAD.size + length == len(body))


def _write(path: Path, out: Path, log: TrialLog, kept: list[RawMessage], reason: str) -> None:
    metadata = {**metadata_of(asdict(log.start)), "recovered_from": path.name}
    ticks = [record.tick for record in log.records()]
    mark = LossEntry(
        tick=ticks[-1] if ticks else -1,
        problem=RECOVERED,
        text=f"{reason}; everything before that place was kept",
    )
    with new_file(out) as passing:
        file = NewFile(passing)
        try:
            made = LogFile(file, describe_channels(), metadata)
            for message in kept:
                made.add(message.channel, message.time_ns, message.payload)
            made.add(RECORDER.id, kept[-1].time_ns, encode_record("Recorder", mark))
            made.finish()
        finally:
            file.close()
