"""Writes one log file. Light to import, because the writer process does little else."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Mapping
from pathlib import Path
from tempfile import TemporaryFile
from typing import IO, TYPE_CHECKING, Any, Final

from mcap.writer import CompressionType, Writer

from palpate.core.errors import LogError

if TYPE_CHECKING:
    # The writer process would load protobuf and numpy with it.
    from palpate.adapters.log.reader import TrialLog

CHUNK_NS: Final = 250_000_000
"""Greatest span of trial time in one chunk: what a kill can cost, with what is still on its way to the writer."""
CHUNK_BYTES: Final = 1 << 20
"""Greatest size of a chunk before compression, should time stand still."""


class LogFile:
    """One log in the making: soundly closed by :meth:`finish`, readable up to its last chunk without.

    Equal messages give equal bytes: chunks end by the messages' own times, and no wall clock enters. The first
    message, what the trial starts with, is a chunk of its own: it is in the file before anything can happen.

    Args:
        channels: Description of schemas and channels, by :func:`describe_channels`.
    """

    def __init__(self, stream: IO[bytes] | NewFile, channels: list[dict[str, Any]], metadata: dict[str, str]) -> None:
        # Parts of the library's interface are not typed.
        self._writer: Any = Writer(
            stream,  # type: ignore[arg-type]
            chunk_size=CHUNK_BYTES,
            compression=CompressionType.ZSTD,
            enable_crcs=True,
            enable_data_crcs=True,
        )
        self._chunk_start_ns: int | None = None
        self.messages = 0
        self._writer.start(profile="palpate", library="palpate")
        for channel in channels:
            schema = self._writer.register_schema(channel["schema"], "protobuf", bytes.fromhex(channel["data"]))
            self._writer.register_channel(channel["topic"], "protobuf", schema, {"about": channel["about"]})
        self._writer.add_metadata("palpate", metadata)

    def add(self, channel: int, time_ns: int, payload: bytes) -> None:
        """Add a message; a chunk that is old enough is written out."""
        time_ns = max(time_ns, 0)  # the format has no time before zero
        # Either way: a message may be older than the one before it.
        if self._chunk_start_ns is None or abs(time_ns - self._chunk_start_ns) >= CHUNK_NS:
            self._writer.flush()
            self._chunk_start_ns = time_ns
        self._writer.add_message(channel, time_ns, payload, time_ns, self.messages)
        self.messages += 1
        if self.messages == 1:
            self._writer.flush()
            self._chunk_start_ns = None

    def finish(self) -> None:
        """Write the rest, the index and the checksums."""
        self._writer.finish()


def describe_channels() -> list[dict[str, Any]]:
    """Schemas and channels of our logs, as plain data that can be handed to another process."""
    from palpate.adapters.log.schema import CHANNELS, PACKAGE, descriptor_set

    return [
        {
            "topic": kind.topic,
            "schema": f"{PACKAGE}.{kind.message}",
            "data": descriptor_set(kind.message).hex(),
            "about": kind.about,
        }
        for kind in CHANNELS
    ]


def metadata_of(start: Mapping[str, Any]) -> dict[str, str]:
    """What a file tells of its trial without being decoded, of what the trial started with."""
    names = ("schema", "command", "arm", "policy", "seed", "trial")
    return {**{name: str(start[name]) for name in names}, "versions": start["versions_json"]}


class NewFile:
    """A file that did not exist before, written without a buffer: what is written is the system's, not ours.

    A full disk does not end it: a reserve is given up, what is being written then still fits, and ``trouble`` says
    that no more should come.

    Args:
        reserve_bytes: Size of the reserve; 0 keeps none.

    Attributes:
        trouble: Why no more should come; None while all is well.

    Raises:
        FileExistsError: Something of that name is there already.
        OSError: The file cannot be made.
    """

    def __init__(self, path: Path, reserve_bytes: int = 0) -> None:
        self.path = path
        self._fd = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o666)
        self._size = 0
        self.trouble: str | None = None
        self._reserve: IO[bytes] | None = None
        if reserve_bytes:
            self._keep_reserve(reserve_bytes)

    def write(self, data: bytes, /) -> int:
        """Write all of it, or leave the file as it was."""
        try:
            self._write_all(data)
        except OSError as error:
            self.trouble = self.trouble or f"cannot be written ({error.strerror})"
            if self._reserve is None:
                raise
            self._give_up_reserve()
            self._write_all(data)
        self._size += len(data)
        return len(data)

    def tell(self) -> int:
        """Bytes written so far."""
        return self._size

    def flush(self) -> None:
        """Nothing is kept back."""

    def close(self) -> None:
        """Close the file; twice too."""
        if self._fd >= 0:
            os.close(self._fd)
            self._fd = -1
        self._give_up_reserve()

    def _write_all(self, data: bytes) -> None:
        view = memoryview(data)
        try:
            while view:
                view = view[os.write(self._fd, view) :]
        except OSError:
            os.ftruncate(self._fd, self._size)
            os.lseek(self._fd, self._size, os.SEEK_SET)
            raise

    def _keep_reserve(self, size: int) -> None:
        """A file without a name: it is gone, and its room free, as soon as we are, however we end."""
        try:
            self._reserve = TemporaryFile(dir=self.path.parent, buffering=0)
            left = size
            while left > 0:
                left -= self._reserve.write(bytes(left))
        except OSError:
            # Not even the reserve fits: the first chunk will tell.
            self._give_up_reserve()

    def _give_up_reserve(self) -> None:
        if self._reserve is not None:
            self._reserve.close()
            self._reserve = None


def dump_json(value: Any) -> str:
    """JSON in one line; floats keep every bit."""
    return json.dumps(value, separators=(",", ":"), ensure_ascii=False)


def json_in(log: TrialLog, field: str, text: str) -> dict[str, Any]:
    """A JSON object that a message of a log holds as text; an empty one for no text.

    Raises:
        LogError: It is none.
    """
    try:
        found = json.loads(text) if text else {}
    except ValueError as error:
        raise LogError(log.path, field, f"is no JSON ({error})", "it was not written by palpate") from error
    if not isinstance(found, dict):
        raise LogError(log.path, field, "is no JSON object", "it was not written by palpate")
    return found


def finite(value: Any) -> Any:
    """The value for JSON: a number that is not finite, which JSON cannot hold, becomes None."""
    if isinstance(value, float) and not math.isfinite(value):
        return None
    if isinstance(value, dict):
        return {key: finite(inner) for key, inner in value.items()}
    if isinstance(value, (list, tuple)):
        return [finite(inner) for inner in value]
    return value
