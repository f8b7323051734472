"""The process that shows: frames in on standard input, a viewer's server out. It ends when its input does."""

import json
import os
import select
import socket
import sys
from typing import Final

from palpate.adapters.log import FRAME, MESSAGE, QUIT, RawMessage
from palpate.adapters.signals import ignore_ending_signals
from palpate.adapters.visualisation.live.display import Display, LearningSoFar
from palpate.adapters.visualisation.live.trial_stream import TrialStream
from palpate.core.errors import LogError

NOTE: Final = b"N"
"""Kind of a frame that is no message of a log: a text and a learning curve, as JSON."""
_READ_BYTES: Final = 1 << 18
_LOOK_S: Final = 0.1
"""So often is looked whether somebody has come who lacks what was shown before."""


def served(viewer: str, port: int) -> Display:
    """The display of that name, for whoever connects to a port of this computer.

    Raises:
        OSError: The port is taken.
        ModuleNotFoundError: The viewer's package is not installed.
    """
    with socket.socket() as tried:
        tried.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        tried.bind(("127.0.0.1", port))
    if viewer == "foxglove":
        from palpate.adapters.visualisation.live.foxglove_display import FoxgloveDisplay

        return FoxgloveDisplay.served(port)
    from palpate.adapters.visualisation.live.rerun_display import RerunDisplay

    return RerunDisplay.served(port)


class WholeFrames:
    """Whole frames out of pieces."""

    def __init__(self) -> None:
        self._rest = b""

    def of(self, data: bytes) -> list[tuple[bytes, RawMessage]]:
        """The frames that these bytes complete: kind, and what it holds."""
        data = self._rest + data
        found, at = [], 0
        while at + FRAME.size <= len(data):
            kind, channel, time_ns, length = FRAME.unpack_from(data, at)
            end = at + FRAME.size + length
            if end > len(data):
                break
            found.append((kind, RawMessage(channel, time_ns, data[at + FRAME.size : end])))
            at = end
        self._rest = data[at:]
        return found


def show(source: int, display: Display) -> None:
    """Show what comes from a file descriptor, to its end."""
    stream, frames = TrialStream(display), WholeFrames()
    while True:
        if select.select([source], [], [], _LOOK_S)[0]:
            data = os.read(source, _READ_BYTES)
            for kind, message in frames.of(data):
                if kind == QUIT:
                    return
                _show(kind, message, stream, display)
            stream.flush()
            if not data:
                return
        display.renew()


def _show(kind: bytes, message: RawMessage, stream: TrialStream, display: Display) -> None:
    if kind == NOTE:
        note = json.loads(message.payload)
        stream.curve = LearningSoFar(**note["curve"])
        display.event(message.time_ns, note["text"])
        if stream.curve.trials:
            display.learned(message.time_ns, stream.curve)
    elif kind == MESSAGE:
        try:
            stream.take(message)
        except LogError as error:
            # One message that cannot be shown must not hide the others.
            display.event(message.time_ns, str(error), serious=True)


def main() -> None:
    """Serve standard input: ``VIEWER PORT``."""
    # Whoever wants an end asks the run for it; it ends us by ending our input.
    ignore_ending_signals()
    # The run comes first.
    os.nice(10)

    def tell(problem: str) -> None:
        sys.stdout.write(json.dumps({"path": "live view", "problem": problem}) + "\n")
        sys.stdout.flush()

    viewer, port = sys.argv[1], int(sys.argv[2])
    try:
        display = served(viewer, port)
    except OSError as error:
        tell(str(error.strerror or error))
        return
    tell("")
    try:
        show(sys.stdin.fileno(), display)
    finally:
        display.close()


if __name__ == "__main__":
    main()
