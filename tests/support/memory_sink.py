"""A sink of logs for tests."""

from io import BytesIO

from palpate.adapters.log import LogFile, Sink, packed


class MemorySink(Sink):
    """Keeps the logs in memory, by name."""

    def __init__(self):
        self.losses = []
        self.streams = {}
        self._log = None

    @property
    def logs(self):
        """The logs, in the order in which they were begun."""
        return [stream.getvalue() for stream in self.streams.values()]

    def open(self, path, metadata):
        self._log = None
        if path in self.streams:
            self.losses.append(f"{path}: exists")
            return
        self.streams[path] = BytesIO()
        self._log = LogFile(self.streams[path], metadata)

    def put(self, batch):
        if self._log is not None:
            self._log.add(packed(batch, self.losses))

    def close(self):
        if self._log is not None:
            self._log.finish()
            self._log = None
