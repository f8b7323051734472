"""Where a recorder's messages go. The loop only hands them over; what takes time happens elsewhere."""

import fcntl
import json
import os
import select
import subprocess
import sys
from abc import abstractmethod
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any, Final, Protocol, cast

from typing_extensions import override

from palpate.adapters.log.file import describe_channels
from palpate.adapters.log.writer_process import CLOSE, OPEN, QUIT, frame
from palpate.core.errors import OutputError

_PIPE_BYTES: Final = 1 << 20
_READ_BYTES: Final = 1 << 16
PATIENCE_S: Final = 60.0
"""A writer that has taken nothing for so long, although there is much to take, or has not even started, is given up."""


@dataclass(frozen=True)
class Opening:
    """Begin of a log."""

    path: Path
    metadata: dict[str, str]


class Sink(Protocol):
    """Takes one log after the other. Only ``open`` and ``close`` may take their time."""

    @abstractmethod
    def open(self, opening: Opening) -> None:
        """Begin a log."""

    @abstractmethod
    def put(self, frames: bytes, *, vital: bool = False) -> bool:
        """Take frames; False when they are lost, all of them.

        Args:
            frames: Whole frames.
            vital: Without these the log is worth nothing: take them even when there is no room.
        """

    @abstractmethod
    def close(self, frames: bytes) -> None:
        """Take the last frames and end the log."""

    def trouble(self) -> str | None:
        """The oldest of what went wrong and was not told yet; None when everything was, or nothing can go wrong."""
        return None

    def shut(self) -> str | None:
        """Finish everything; returns as ``trouble`` does, which says the rest."""
        return None

    @property
    def gone(self) -> bool:
        """Whether nobody takes anything any more."""
        return False


class ProcessSink(Sink):
    """A process of its own writes the files, at the other end of a pipe that is never waited for in the loop.

    What the pipe does not take at once waits in a queue here. A process and not a thread, because a thread that
    compresses fights the loop for the interpreter (measured: docs/results.md).

    Args:
        queue_bytes: Frames that may wait here beyond what the pipe holds. An empty queue takes anything.
        patient: When the queue is full, wait for the writer instead of refusing: for a world whose time waits too.
        patience_s: How long to wait, here and when everything is shut, for a writer that takes nothing at all.
        program: The writer's module, and words for it.
    """

    def __init__(
        self,
        *,
        queue_bytes: int,
        patient: bool,
        patience_s: float = PATIENCE_S,
        program: Sequence[str] = ("palpate.adapters.log.writer_process",),
        called: str = "log writer",
    ) -> None:
        self._called = called
        self._queue: deque[memoryview] = deque()
        self._queued, self._room, self._patient, self._patience_s = 0, queue_bytes, patient, patience_s
        self._reports = b""
        self._troubles: deque[str] = deque()
        self._path = ""
        self._ready = self._gone = self._shut = False
        # Not with this folder's modules before the library's; and in a process group of its own, because Ctrl-C is
        # for the run: the run ends when it ends, and the log is to hold it.
        command = [sys.executable, "-P", "-m", *program]
        pipe = subprocess.PIPE
        self._process = subprocess.Popen(command, stdin=pipe, stdout=pipe, bufsize=0, process_group=0)
        # Both are there, because pipes were asked for.
        self._stdin = cast(IO[bytes], self._process.stdin)
        self._stdout = cast(IO[bytes], self._process.stdout)
        self._pipe, self._answers = self._stdin.fileno(), self._stdout.fileno()
        os.set_blocking(self._pipe, False)
        os.set_blocking(self._answers, False)
        _enlarge(self._pipe)
        self._enqueue(frame(OPEN, json.dumps(describe_channels()).encode()))

    @property
    @override
    def gone(self) -> bool:
        return self._gone

    @property
    def queued_bytes(self) -> int:
        """What waits here because the pipe is full."""
        return self._queued

    @property
    def process_id(self) -> int:
        """The writer's."""
        return self._process.pid

    @override
    def open(self, opening: Opening) -> None:
        """The first time, waits until the writer runs."""
        # The writer stays in the folder where it was started.
        self._path = os.path.abspath(opening.path)
        self.await_writer()
        if self._gone:
            self._troubles.append(f"{self._path}: is not recorded, because the {self._called} is gone")
        told = {"path": self._path, "metadata": opening.metadata}
        self._enqueue(frame(OPEN, json.dumps(told).encode()))
        self._push()

    @override
    def put(self, frames: bytes, *, vital: bool = False) -> bool:
        self._push()
        # An empty queue takes anything: else a batch larger than the queue would never get through.
        if self._queued and self._queued + len(frames) > self._room and not vital:
            if not self._patient:
                return False
            self._drain(self._room - len(frames))
        self._enqueue(frames)
        self._push()
        return not self._gone

    @override
    def close(self, frames: bytes) -> None:
        """What still waits is written while the next trial runs."""
        self._enqueue(frames)
        self._enqueue(frame(CLOSE))
        self._push()

    @override
    def trouble(self) -> str | None:
        self._listen()
        return self._troubles.popleft() if self._troubles else None

    @override
    def shut(self) -> str | None:
        """The writer is gone then, one way or the other."""
        if not self._shut:
            # Said, and not only shown by the pipe's end: a fork of this process may hold that open.
            self._enqueue(frame(QUIT))
            self._push()
            self._drain(0)
            self._stdin.close()
            while self._listen():
                if not select.select([self._answers], [], [], self._patience_s)[0]:
                    self._give_up(f"does not end; killed after {self._patience_s:g} s")
            self._shut = True
            self._stdout.close()
            code = self._process.wait()
            if code and not self._gone:
                self._troubles.append(f"the {self._called} ended with code {code}")
            # What comes now goes nowhere, and above all not into whatever was given the number of our pipe.
            self._gone = True
        return self.trouble()

    def await_writer(self) -> None:
        """Wait until the writer runs.

        Raises:
            OutputError: It does not start.
        """
        while not self._ready and not self._gone:
            heard = select.select([self._answers], [], [], PATIENCE_S)[0]
            if not heard or (not self._listen() and not self._ready):
                self._give_up("does not start")
                remedy = "what it printed says more; mend that, or switch recording off"
                raise OutputError(self._called, "does not start", remedy)

    def _enqueue(self, frames: bytes) -> None:
        if frames and not self._gone:
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
                self._give_up(f"is gone ({error.strerror})")
                return
            self._queued -= done
            if done == len(queue[0]):
                queue.popleft()
            else:
                queue[0] = queue[0][done:]

    def _drain(self, most: int) -> None:
        """Wait until the pipe has taken so much that no more than this is left."""
        while self._queued > max(most, 0):
            # A writer whose reports nobody takes in would wait for us in turn.
            self._listen()
            if not select.select([], [self._pipe], [], self._patience_s)[1]:
                self._give_up(f"has taken nothing for {self._patience_s:g} s and was killed")
            self._push()

    def _give_up(self, why: str) -> None:
        """Go on without the writer. It is reported once, here, and at each log that is not recorded for it."""
        if not self._gone:
            self._gone = True
            self._troubles.append(f"{self._path or 'recording'}: the {self._called} {why}")
            self._process.kill()
        self._queue.clear()
        self._queued = 0

    def _listen(self) -> bool:
        """Take in what the writer has to say, in lines of JSON; False when it has said its last word."""
        if self._shut:
            return False
        try:
            while answer := os.read(self._answers, _READ_BYTES):
                self._reports += answer
            alive = False
        except BlockingIOError:
            alive = True
        *lines, self._reports = self._reports.split(b"\n")
        for line in lines:
            told = json.loads(line)
            self._ready = True
            if told["problem"]:
                self._troubles.append(f"{told['path']}: {told['problem']}")
        return alive


def _enlarge(pipe: int) -> None:
    """A larger pipe, where the system grants it: the queue behind it then stays empty."""
    set_size: Any = getattr(fcntl, "F_SETPIPE_SZ", None)
    if set_size is not None:
        try:
            fcntl.fcntl(pipe, set_size, _PIPE_BYTES)
        except OSError:
            # A smaller pipe serves too.
            return
