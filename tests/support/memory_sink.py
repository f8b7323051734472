"""A sink of logs for tests."""

from collections.abc import Callable
from io import BytesIO
from pathlib import Path

from typing_extensions import override

from palpate.adapters.log.file import LogFile
from palpate.adapters.log.sink import Sink


class MemorySink(Sink):
    """Keeps the logs in memory, one after the other."""

    def __init__(self) -> None:
        self.logs: list[bytes] = []
        self._open: tuple[LogFile, BytesIO] | None = None

    @override
    def open(self, path: Path, metadata: dict[str, str]) -> None:
        stream = BytesIO()
        self._open = (LogFile(stream, metadata), stream)

    @override
    def put(self, pack: Callable[[], bytes]) -> None:
        if self._open is not None:
            self._open[0].add(pack())

    @override
    def close(self) -> None:
        if self._open is not None:
            self._open[0].finish()
            self.logs.append(self._open[1].getvalue())
            self._open = None
