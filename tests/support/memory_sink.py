"""A sink of logs for tests."""

from io import BytesIO

from palpate.adapters.log import PackedLog, Sink


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
        self._log = PackedLog(self.streams[path], metadata, self.losses)

    def put(self, message):
        if self._log is not None:
            self._log.add(message)

    def close(self):
        if self._log is not None:
            self._log.finish()
            self._log = None
