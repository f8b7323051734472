"""A sink of logs for tests."""

from io import BytesIO

from typing_extensions import override

from palpate.adapters.log.file import LogFile, describe_channels
from palpate.adapters.log.writer_client import Opening, Sink
from palpate.adapters.log.writer_process import messages_in


class MemorySink(Sink):
    """Keeps the logs in memory, one after the other."""

    def __init__(self) -> None:
        self.logs: list[bytes] = []
        self._open: tuple[LogFile, BytesIO] | None = None

    @override
    def open(self, opening: Opening) -> None:
        stream = BytesIO()
        self._open = (LogFile(stream, describe_channels(), opening.metadata), stream)

    @override
    def put(self, frames: bytes, *, vital: bool = False) -> bool:
        if self._open is not None:
            for channel, time_ns, payload in messages_in(frames):
                self._open[0].add(channel, time_ns, payload)
        return True

    @override
    def close(self, frames: bytes) -> None:
        if self._open is not None:
            self.put(frames)
            self._open[0].finish()
            self.logs.append(self._open[1].getvalue())
            self._open = None
