"""A device for tests of lines."""


class Echo:
    """Answers every line, and says something by itself when asked to."""

    def __init__(self, baud: int = 115_200) -> None:
        self.baud = baud
        self.spontaneous = b""
        self._line = b""

    def feed(self, data: bytes, now_ns: int) -> bytes:
        self._line += data
        if not self._line.endswith(b"\n"):
            return b""
        line, self._line = self._line, b""
        return line

    def advance(self, now_ns: int) -> bytes:
        said, self.spontaneous = self.spontaneous, b""
        return said
