"""The writer process: frames in on standard input, log files out, troubles back on standard output.

It ends when its input does. Whoever fed it may be gone by then: the log that is open is closed soundly all the same.
"""

from __future__ import annotations

import json
import signal
import struct
import sys
from pathlib import Path
from typing import Any, BinaryIO

from palpate.adapters.log.file import LogFile, NewFile

_FRAME = struct.Struct("<cBqI")


class Writer:
    """Writes one log after the other.

    Args:
        report: Takes a line about a log that could not be written as it should.
    """

    def __init__(self, report: Any) -> None:
        self._report = report
        self._channels: list[dict[str, Any]] | None = None
        self._file: NewFile | None = None
        self._log: LogFile | None = None
        self._path = ""

    def take(self, kind: bytes, channel: int, time_ns: int, payload: bytes) -> None:
        """Do what one frame says."""
        if kind == b"M":
            self._message(channel, time_ns, payload)
        elif kind == b"C":
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
        try:
            if log is not None:
                log.finish()
        except OSError as error:
            self._tell(f"cannot be finished ({error.strerror})")
        finally:
            file.close()

    def _open(self, told: dict[str, Any]) -> None:
        self.finish()
        self._path = told["path"]
        path = Path(self._path)
        try:
            self._file = NewFile(path, path.with_name(".reserve"))
            self._log = LogFile(self._file, self._channels or [], told["metadata"])
        except OSError as error:
            self._tell(f"cannot be made ({error.strerror})")

    def _message(self, channel: int, time_ns: int, payload: bytes) -> None:
        if self._log is None or self._file is None:
            return
        try:
            self._log.add(channel, time_ns, payload)
        except OSError as error:
            self._tell(f"cannot be written ({error.strerror})")
            self._log = None
            return
        if self._file.trouble is not None:
            # What is written so far still fits into the reserve; this is the time to end soundly, with a mark.
            self._tell(self._file.trouble)
            self._mark(time_ns, self._file.trouble)
            self.finish()

    def _mark(self, time_ns: int, problem: str) -> None:
        from palpate.adapters.log.schema import RECORDER, encode

        if self._log is not None:
            text = "nothing after this was kept"
            self._log.add(RECORDER.id, time_ns, encode("Recorder", tick=0, problem=problem, text=text))

    def _tell(self, problem: str) -> None:
        self._report(json.dumps({"path": self._path, "problem": problem}))


def serve(source: BinaryIO, report: Any) -> None:
    """Write what the source says, to its end."""
    writer = Writer(report)
    try:
        while head := _exactly(source, _FRAME.size):
            kind, channel, time_ns, length = _FRAME.unpack(head)
            payload = _exactly(source, length)
            if len(payload) < length:
                break
            writer.take(kind, channel, time_ns, payload)
    finally:
        writer.finish()


def _exactly(source: BinaryIO, length: int) -> bytes:
    """So many bytes, or none or fewer at the end."""
    data = source.read(length) if length else b""
    return data if len(data) == length or length == 0 else b""


def main() -> None:
    """Serve standard input."""
    # Ctrl-C reaches the whole group: the run decides when it ends, and the log is to tell of it.
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_IGN)

    def report(line: str) -> None:
        try:
            sys.stdout.write(line + "\n")
            sys.stdout.flush()
        except OSError:
            # Nobody listens any more.
            return

    serve(sys.stdin.buffer, report)


if __name__ == "__main__":
    main()
