"""Where a recorder's messages go. The loop only hands them over; what takes time happens elsewhere."""

from __future__ import annotations

import fcntl
import json
import os
import select
import struct
import subprocess
import sys
from abc import abstractmethod
from collections import deque
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, Protocol

from palpate.adapters.log.file import LogFile, describe_channels
from palpate.core.errors import OutputError

FRAME: Final = struct.Struct("<cBqI")
"""Kind of frame, channel, time, length of what follows."""
OPEN, MESSAGE, CLOSE = b"O", b"M", b"C"
_PIPE_BYTES: Final = 1 << 20


@dataclass(frozen=True)
class Opening:
    """Begin of a log.

    Attributes:
        path: Where it goes; nothing may be there yet.
        metadata: Facts for tools that know nothing of our messages.
    """

    path: Path
    metadata: dict[str, str]


class Sink(Protocol):
    """Takes one log after the other. Only ``open`` and ``close`` may take their time."""

    @abstractmethod
    def open(self, opening: Opening) -> None:
        """Begin a log.

        Raises:
            OutputError: That is not possible.
        """

    @abstractmethod
    def put(self, frames: bytes) -> bool:
        """Take frames; False when there is no room, and then none of them is taken."""

    @abstractmethod
    def close(self, frames: bytes) -> None:
        """Take the last frames and end the log."""

    @abstractmethod
    def trouble(self) -> str | None:
        """What went wrong since it was last asked."""

    @abstractmethod
    def shut(self) -> str | None:
        """Finish everything; returns what went wrong since ``trouble`` was last asked."""


class MemorySink(Sink):
    """Keeps everything in memory, log by log: for tests and short logs.

    Attributes:
        logs: The logs finished so far, as the bytes of their files.
    """

    def __init__(self) -> None:
        self.logs: list[bytes] = []
        self._open: tuple[LogFile, _Buffer] | None = None

    def open(self, opening: Opening) -> None:
        """See :class:`Sink`."""
        stream = _Buffer()
        self._open = (LogFile(stream, describe_channels(), opening.metadata), stream)

    def put(self, frames: bytes) -> bool:
        """See :class:`Sink`."""
        if self._open is not None:
            for channel, time_ns, payload in messages_in(frames):
                self._open[0].add(channel, time_ns, payload)
        return True

    def close(self, frames: bytes) -> None:
        """See :class:`Sink`."""
        if self._open is not None:
            self.put(frames)
            self._open[0].finish()
            self.logs.append(bytes(self._open[1].data))
            self._open = None

    def trouble(self) -> str | None:
        """Nothing can go wrong."""
        return None

    def shut(self) -> str | None:
        """Nothing to do."""
        return None


class ProcessSink(Sink):
    """A process of its own writes the files, at the other end of a pipe that is never waited for in the loop.

    What the pipe does not take at once waits in a queue here. A process and not a thread, because a thread that
    compresses fights the loop for the interpreter (measured: docs/results.md).

    Args:
        queue_bytes: Frames that may wait here beyond what the pipe holds.
        patient: When the queue is full, wait for the writer instead of refusing: for a world whose time waits too.
    """

    def __init__(self, *, queue_bytes: int, patient: bool) -> None:
        self._queue: deque[memoryview] = deque()
        self._queued, self._room, self._patient = 0, queue_bytes, patient
        self._reports = b""
        self._failed: str | None = None
        self._awaited = 0
        command = [sys.executable, "-m", "palpate.adapters.recording.writer"]
        try:
            self._process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, bufsize=0)
        except OSError as error:
            remedy = "mend that, or switch recording off"
            raise OutputError("log writer", f"cannot be started ({error.strerror})", remedy) from error
        pipe, answers = self._process.stdin, self._process.stdout
        if pipe is None or answers is None:
            raise OutputError("log writer", "has no pipes", "this cannot happen")
        self._pipe, self._answers = pipe.fileno(), answers.fileno()
        os.set_blocking(self._pipe, False)
        os.set_blocking(self._answers, False)
        _enlarge(self._pipe)
        self._enqueue(_frame(OPEN, json.dumps(describe_channels()).encode()))

    def open(self, opening: Opening) -> None:
        """See :class:`Sink`."""
        told = {"path": str(opening.path), "metadata": opening.metadata}
        self._enqueue(_frame(OPEN, json.dumps(told).encode()))
        self._push()

    def put(self, frames: bytes) -> bool:
        """See :class:`Sink`."""
        self._push()
        if self._queued + len(frames) > self._room:
            if not self._patient:
                return False
            self._drain(self._room - len(frames))
        self._enqueue(frames)
        self._push()
        return True

    def close(self, frames: bytes) -> None:
        """See :class:`Sink`. What still waits is written while the next trial runs."""
        self._enqueue(frames)
        self._enqueue(_frame(CLOSE, b""))
        self._awaited += 1
        self._push()

    def trouble(self) -> str | None:
        """See :class:`Sink`."""
        self._listen()
        failed, self._failed = self._failed, None
        return failed

    def shut(self) -> str | None:
        """See :class:`Sink`."""
        self._drain(0)
        self._process.stdin.close()  # type: ignore[union-attr]
        os.set_blocking(self._answers, True)
        while True:
            answer = os.read(self._answers, 1 << 16)
            if not answer:
                break
            self._reports += answer
        code = self._process.wait()
        self._process.stdout.close()  # type: ignore[union-attr]
        if code and self._failed is None:
            self._failed = f"the log writer ended with code {code}"
        return self.trouble()

    def _enqueue(self, frames: bytes) -> None:
        if frames:
            self._queue.append(memoryview(frames))
            self._queued += len(frames)

    def _push(self) -> None:
        """Hand over what the pipe takes now."""
        queue = self._queue
        while queue:
            try:
                done = os.write(self._pipe, queue[0])
            except BlockingIOError:
                return
            except OSError as error:
                self._failed = self._failed or f"the log writer is gone ({error.strerror})"
                queue.clear()
                self._queued = 0
                return
            self._queued -= done
            if done == len(queue[0]):
                queue.popleft()
            else:
                queue[0] = queue[0][done:]

    def _drain(self, most: int) -> None:
        while self._queued > max(most, 0):
            select.select([], [self._pipe], [])
            self._push()

    def _listen(self) -> None:
        """Take in what the writer has reported: one line of JSON for each log that it had trouble with."""
        try:
            while answer := os.read(self._answers, 1 << 16):
                self._reports += answer
        except (BlockingIOError, ValueError, OSError):
            # Nothing there, or closed already.
            pass
        *lines, self._reports = self._reports.split(b"\n")
        for line in lines:
            told = json.loads(line)
            self._failed = self._failed or f"{told['path']}: {told['problem']}"


def messages_in(frames: bytes) -> list[tuple[int, int, bytes]]:
    """Channel, time and payload of the message frames."""
    found, at = [], 0
    while at < len(frames):
        _, channel, time_ns, length = FRAME.unpack_from(frames, at)
        at += FRAME.size
        found.append((channel, time_ns, frames[at : at + length]))
        at += length
    return found


class _Buffer:
    """A stream in memory."""

    def __init__(self) -> None:
        self.data = bytearray()

    def write(self, data: bytes, /) -> int:
        self.data += data
        return len(data)

    def tell(self) -> int:
        return len(self.data)

    def flush(self) -> None: ...


def _frame(kind: bytes, content: bytes) -> bytes:
    return FRAME.pack(kind, 0, 0, len(content)) + content


def _enlarge(pipe: int) -> None:
    """A larger pipe, where the system grants it: the queue behind it then stays empty."""
    set_size: Any = getattr(fcntl, "F_SETPIPE_SZ", None)
    if set_size is not None:
        try:
            fcntl.fcntl(pipe, set_size, _PIPE_BYTES)
        except OSError:
            # A smaller pipe serves too.
            return
