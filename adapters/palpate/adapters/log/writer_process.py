"""The writer process: frames in on standard input, log files out, troubles back on standard output.

It ends when its input does. Whoever fed it may be gone by then: the log that is open is closed soundly all the same.
"""

import json
import struct
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any, BinaryIO, Final

from palpate.adapters.log.file import LogFile, NewFile
from palpate.adapters.signals import ignore_ending_signals

FRAME: Final = struct.Struct("<cBqI")
"""Kind of frame, channel, time, length of what follows."""
OPEN = b"O"
MESSAGE = b"M"
CLOSE = b"C"
QUIT = b"Q"
"""Kinds. The first ``OPEN`` describes the channels of all logs; ``QUIT`` is the last frame, sent or not."""


def frame(kind: bytes, content: bytes = b"") -> bytes:
    """A frame that is no message."""
    return FRAME.pack(kind, 0, 0, len(content)) + content


def message_frame(channel: int, time_ns: int, payload: bytes) -> bytes:
    """A message for the open log."""
    return FRAME.pack(MESSAGE, channel, time_ns, len(payload)) + payload


def messages_in(frames: bytes) -> list[tuple[int, int, bytes]]:
    """Channel, time and payload of the message frames."""
    found, at = [], 0
    while at < len(frames):
        _, channel, time_ns, length = FRAME.unpack_from(frames, at)
        at += FRAME.size
        found.append((channel, time_ns, frames[at : at + length]))
        at += length
    return found


TICK_CHANNEL: Final = 2
"""That of the schema, which is not imported for its number: it would slow down the start."""

RESERVE_BYTES: Final = 1 << 18
"""Kept back from the disk for the end of a log: the chunk under way, the index and the checksums."""


class Writer:
    """Writes one log after the other. Trouble with one log does not end it: others may follow.

    Args:
        report: Takes path and problem of a log that could not be written as it should.
    """

    def __init__(self, report: Callable[[str, str], None]) -> None:
        self._report = report
        self._channels: list[dict[str, Any]] | None = None
        self._file: NewFile | None = None
        self._log: LogFile | None = None
        self._path = ""
        self._last_tick = b""

    def take(self, kind: bytes, channel: int, time_ns: int, payload: bytes) -> None:
        """Do what one frame says."""
        if kind == MESSAGE:
            self._message(channel, time_ns, payload)
        elif kind == CLOSE:
            self.finish()
        elif self._channels is None:
            self._channels = json.loads(payload)
        else:
            self._open(json.loads(payload))

    def finish(self) -> None:
        """End the open log, if there is one."""
        log, file = self._log, self._file
        self._log = self._file = None
        if file is None:
            return
        before = file.trouble
        try:
            if log is not None:
                log.finish()
            if file.trouble != before:
                self._tell(f"{file.trouble}; the reserve took its end")
        except Exception as error:
            self._tell(f"cannot be finished ({_reason(error)})")
        finally:
            file.close()

    def _open(self, told: dict[str, Any]) -> None:
        self.finish()
        self._path, self._last_tick = told["path"], b""
        try:
            self._file = NewFile(Path(self._path), RESERVE_BYTES)
            self._log = LogFile(self._file, self._channels or [], told["metadata"])
        except Exception as error:
            self._tell(f"cannot be made ({_reason(error)})")

    def _message(self, channel: int, time_ns: int, payload: bytes) -> None:
        log, file = self._log, self._file
        if log is None or file is None:
            return
        if channel == TICK_CHANNEL:
            self._last_tick = payload
        try:
            log.add(channel, time_ns, payload)
            if file.trouble is not None:
                # What is written so far still fits into the reserve; this is the time to end soundly, with a mark.
                self._mark(log, time_ns, file.trouble)
        except Exception as error:
            # The library is in the middle of something: what is on disk stays as it is, up to its last whole chunk.
            self._tell(f"cannot be written ({_reason(error)}); nothing after that is kept")
            self._log = None
            self.finish()
            return
        if file.trouble is not None:
            self._tell(f"{file.trouble}; nothing after that is kept")
            self.finish()

    def _mark(self, log: LogFile, time_ns: int, problem: str) -> None:
        from palpate.adapters.log.schema import RECORDER, encode
        from palpate.adapters.log.tick_layout import decode_tick

        tick = decode_tick(self._last_tick).tick if self._last_tick else -1
        text = "nothing after this is kept"
        log.add(RECORDER.id, time_ns, encode("Recorder", tick=tick, problem=problem, text=text))

    def _tell(self, problem: str) -> None:
        self._report(self._path, problem)


def serve(source: BinaryIO, report: Callable[[str, str], None]) -> None:
    """Write what the source says, to its end; ``report`` is as of :class:`Writer`."""
    writer = Writer(report)
    try:
        while head := _exactly(source, FRAME.size):
            kind, channel, time_ns, length = FRAME.unpack(head)
            payload = _exactly(source, length)
            if kind == QUIT or len(payload) < length:
                break
            writer.take(kind, channel, time_ns, payload)
    finally:
        writer.finish()


def _exactly(source: BinaryIO, length: int) -> bytes:
    """So many bytes, or none when the end comes first."""
    data = source.read(length) if length else b""
    return data if len(data) == length else b""


def _reason(error: Exception) -> str:
    return str(getattr(error, "strerror", None) or error or type(error).__name__)


def main() -> None:
    """Serve standard input."""
    # An end is asked of the run; it ends us by ending our input.
    ignore_ending_signals()

    def report(path: str, problem: str) -> None:
        try:
            sys.stdout.write(json.dumps({"path": path, "problem": problem}) + "\n")
            sys.stdout.flush()
        except OSError:
            # Nobody listens any more.
            return

    # Nothing to report, but this shows the run that we are there.
    report("", "")
    serve(sys.stdin.buffer, report)


if __name__ == "__main__":
    main()
