"""A sink of logs for tests."""

from collections.abc import Sequence
from io import BytesIO
from pathlib import Path

from typing_extensions import override

from palpate.adapters.log import LogFile, LogMessage, Sink, packed


class MemorySink(Sink):
    """Keeps the logs in memory, by name."""

    def __init__(self) -> None:
        self.troubles = []
        self.streams: dict[Path, BytesIO] = {}
        self._log: LogFile | None = None

    @property
    def logs(self) -> list[bytes]:
        """The logs, in the order in which they were begun."""
        return [stream.getvalue() for stream in self.streams.values()]

    @override
    def open(self, path: Path, metadata: dict[str, str]) -> None:
        self._log = None
        if path in self.streams:
            self.troubles.append(f"{path}: is there already")
            return
        self.streams[path] = BytesIO()
        self._log = LogFile(self.streams[path], metadata)

    @override
    def put(self, batch: Sequence[LogMessage]) -> None:
        if self._log is not None:
            self._log.add(packed(batch, self.troubles))

    @override
    def close(self) -> None:
        if self._log is not None:
            self._log.finish()
            self._log = None
