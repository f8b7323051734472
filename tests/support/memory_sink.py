"""A sink of logs for tests."""

from collections.abc import Sequence
from io import BytesIO
from pathlib import Path

from typing_extensions import override

from palpate.adapters.log import LogFile, LogMessage, Sink, packed


class MemorySink(Sink):
    """Keeps the logs in memory, one after the other."""

    def __init__(self) -> None:
        self.troubles = []
        self.logs: list[bytes] = []

    @override
    def open(self, path: Path, metadata: dict[str, str]) -> None:
        self._stream = BytesIO()
        self._log = LogFile(self._stream, metadata)

    @override
    def put(self, batch: Sequence[LogMessage]) -> None:
        self._log.add(packed(batch, self.troubles))

    @override
    def close(self) -> None:
        self._log.finish()
        self.logs.append(self._stream.getvalue())
