"""Destinations for a recorder's messages: files that a separate thread writes, so that the loop never waits."""

from abc import abstractmethod
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from pathlib import Path
from threading import Event, Thread
from typing import IO, Any, Final, NamedTuple, Protocol

from typing_extensions import override

from palpate.adapters.log.container import LogFile, RawMessage
from palpate.adapters.log.messages import encode
from palpate.adapters.log.records import LossEntry, TickRecord
from palpate.adapters.log.schema import BY_RECORD, RECORDER

TIMEOUT_S: Final = 60.0
"""Time-out for writing the end of a log."""
_CHUNK: Final = 35
"""Messages per chunk: a quarter of a second of ticks, which a killed process may lose. Smaller chunks are slower."""
_LOOK_S: Final = 0.01
"""Interval at which the thread checks for messages of an open log."""
_UNFIT: Final = (ValueError, TypeError, OverflowError, KeyError)
"""Errors from packing a value that does not fit the message, such as a number of more than 64 bits."""


class LogMessage(NamedTuple):
    """A record before packing or, for a complete tick, the arguments of :meth:`TickRecord.of`."""

    record: Any
    time_ns: int
    sequence: int
    tick: int


class Sink(Protocol):
    """Destination for a series of logs. Only ``open`` and ``close`` block. ``losses`` lists lost data with reasons."""

    losses: list[str]
    takes_ticks: bool = True

    @abstractmethod
    def open(self, path: Path, metadata: dict[str, str]) -> None:
        """Close the open log, if there is one, and begin another."""

    @abstractmethod
    def put(self, message: LogMessage) -> None:
        """Accept a message. Its record must not change afterwards."""

    @abstractmethod
    def close(self) -> None:
        """Close the log."""

    def shut(self) -> None:
        """Finish all logs."""


class PackedLog:
    """Log of packed messages, written in chunks that depend only on the messages. ``losses`` receives lost data."""

    def __init__(self, stream: IO[bytes], metadata: dict[str, str], losses: list[str]) -> None:
        self._file, self._losses = LogFile(stream, metadata), losses
        self._chunk: list[LogMessage] = []

    def add(self, message: LogMessage) -> None:
        """Add a message."""
        self._chunk.append(message)
        if message.sequence % _CHUNK == 0:
            self._write()

    def finish(self) -> None:
        """Write the end of the log."""
        self._write()
        self._file.finish()

    def _write(self) -> None:
        chunk, self._chunk = self._chunk, []
        if chunk:
            self._file.add(map(self._packed, chunk))

    def _packed(self, message: LogMessage) -> RawMessage:
        """Pack a message. A message that cannot be packed is lost and reported, and the trial continues."""
        kept, time_ns, sequence, tick = message
        record = TickRecord.of(*kept) if isinstance(kept, tuple) else kept
        kind = BY_RECORD[type(record)]
        try:
            payload = encode(record)
        except _UNFIT as error:
            self._losses.append(f"a message on {kind.topic} at tick {tick} cannot be packed ({error})")
            text = f"a message on {kind.topic} is missing"
            kind = RECORDER
            payload = encode(LossEntry(tick=tick, problem="cannot be packed", text=text, dropped_messages=1))
        return RawMessage(kind.id, time_ns, payload, sequence)


class FileSink(Sink):
    """Sink with one file per log and a time-out for closing a file. An error in one log does not affect later logs."""

    def __init__(self, timeout_s: float = TIMEOUT_S) -> None:
        self.losses = []
        self._timeout_s = timeout_s
        self._jobs: deque[LogMessage | Callable[[], object] | None] = deque()
        self._urgent = Event()
        self._thread: Thread | None = None
        self._path = Path()
        self._file: IO[bytes] | None = None
        self._log: PackedLog | None = None

    @override
    def open(self, path: Path, metadata: dict[str, str]) -> None:
        if self._thread is None:
            self._thread = Thread(target=self._work, name="log writer", daemon=True)
            self._thread.start()
        path.parent.mkdir(parents=True, exist_ok=True)
        # The working directory may change before the thread opens the file.
        self._jobs.append(partial(self._begin, path.absolute(), metadata))
        self._urgent.set()

    @override
    def put(self, message: LogMessage) -> None:
        # The thread finds it by itself: waking it would cost the loop more time than everything else.
        self._jobs.append(message)

    def close(self) -> None:
        """Wait until the log is written."""
        done = Event()
        self._jobs += self._finish, done.set
        self._urgent.set()
        if not done.wait(self._timeout_s):
            self.losses.append(f"{self._path}: its end was not written within {self._timeout_s:g} s")

    @override
    def shut(self) -> None:
        if self._thread is not None:
            self._jobs.append(None)
            self._urgent.set()
            self._thread.join(self._timeout_s)
            self._thread = None

    # In the thread.

    def _work(self) -> None:
        while (job := self._next()) is not None:
            try:
                if not isinstance(job, LogMessage):
                    job()
                elif self._log is not None:
                    self._log.add(job)
            except Exception as error:
                reason = str(getattr(error, "strerror", None) or error or type(error).__name__)
                self.losses.append(f"{self._path}: cannot be written ({reason}); nothing after that is kept")
                self._leave()
        self._leave()

    def _next(self) -> LogMessage | Callable[[], object] | None:
        while not self._jobs:
            self._urgent.wait(None if self._log is None else _LOOK_S)
            self._urgent.clear()
        return self._jobs.popleft()

    def _begin(self, path: Path, metadata: dict[str, str]) -> None:
        self._leave()
        self._path = path
        self._file = path.open("xb")
        self._log = PackedLog(self._file, metadata, self.losses)

    def _finish(self) -> None:
        if self._log is not None and self._file is not None:
            self._log.finish()
            self._file.close()
        self._leave()

    def _leave(self) -> None:
        file, self._file, self._log = self._file, None, None
        if file is not None:
            # Data that a full disk did not accept are lost.
            with suppress(OSError):
                file.close()
