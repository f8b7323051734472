"""Where a recorder's messages go: into files, which a thread packs and writes, so that the loop never waits."""

import os
from abc import abstractmethod
from collections import deque
from collections.abc import Callable
from functools import partial
from io import FileIO
from pathlib import Path
from queue import SimpleQueue
from threading import Event, Thread
from typing import Final, Protocol

from typing_extensions import override

from palpate.adapters.log.file import LogFile

PATIENCE_S: Final = 60.0
"""How long the end of a log may take to be written before that is given up."""


class Sink(Protocol):
    """Takes one log after the other. Only ``open`` and ``close`` may take their time."""

    @abstractmethod
    def open(self, path: Path, metadata: dict[str, str]) -> None:
        """Begin a log."""

    @abstractmethod
    def put(self, pack: Callable[[], bytes]) -> None:
        """Take messages.

        Args:
            pack: Gives their MCAP records; it may be called in another thread.
        """

    @abstractmethod
    def close(self) -> None:
        """End the log."""

    def trouble(self) -> str | None:
        """The oldest trouble that was not returned yet; None if there is none."""
        return None

    def shut(self) -> None:
        """Finish everything."""


class FileSink(Sink):
    """Writes each log into a file. Trouble with one log does not end it: others may follow.

    Args:
        patience_s: How long :meth:`close` waits.
    """

    def __init__(self, patience_s: float = PATIENCE_S) -> None:
        self._patience_s = patience_s
        self._jobs: SimpleQueue[Callable[[], None] | None] = SimpleQueue()
        self._troubles: deque[str] = deque()
        self._thread: Thread | None = None
        self._path = Path()
        self._file: _WholeWrites | None = None
        self._log: LogFile | None = None

    @override
    def open(self, path: Path, metadata: dict[str, str]) -> None:
        if self._thread is None:
            self._thread = Thread(target=self._work, name="log writer", daemon=True)
            self._thread.start()
        path.parent.mkdir(parents=True, exist_ok=True)
        # The working directory may change before the thread comes to it.
        self._jobs.put(partial(self._begin, path.absolute(), metadata))

    @override
    def put(self, pack: Callable[[], bytes]) -> None:
        self._jobs.put(partial(self._add, pack))

    @override
    def close(self) -> None:
        """Wait until the log is written."""
        done = Event()
        self._jobs.put(self._finish)
        self._jobs.put(done.set)
        if not done.wait(self._patience_s):
            self._troubles.append(f"{self._path}: its end was not written within {self._patience_s:g} s")

    @override
    def trouble(self) -> str | None:
        return self._troubles.popleft() if self._troubles else None

    @override
    def shut(self) -> None:
        if self._thread is not None:
            self._jobs.put(None)
            self._thread.join(self._patience_s)
            self._thread = None

    # In the thread.

    def _work(self) -> None:
        while (job := self._jobs.get()) is not None:
            try:
                job()
            except Exception as error:
                reason = str(getattr(error, "strerror", None) or error or type(error).__name__)
                self._troubles.append(f"{self._path}: cannot be written ({reason}); nothing after that is kept")
                self._leave()

    def _begin(self, path: Path, metadata: dict[str, str]) -> None:
        self._path = path
        self._file = _WholeWrites(path)
        self._log = LogFile(self._file, metadata)

    def _add(self, pack: Callable[[], bytes]) -> None:
        if self._log is not None:
            self._log.add(pack())

    def _finish(self) -> None:
        if self._log is not None:
            self._log.finish()
            self._leave()

    def _leave(self) -> None:
        self._log = None
        if self._file is not None:
            self._file.close()
            self._file = None


_write = FileIO.write


class _WholeWrites(FileIO):
    """A file that was not there before; of each write it takes all, or nothing."""

    def __init__(self, path: Path) -> None:
        super().__init__(path, "x")
        self._taken = 0

    @override
    def write(self, data: bytes, /) -> int:  # type: ignore[override]
        view = memoryview(data)
        try:
            while view:
                view = view[_write(self, view) :]
        except OSError:
            os.ftruncate(self.fileno(), self._taken)
            raise
        self._taken += len(data)
        return len(data)
