"""What goes through the pipe to the writer process: frames. Light to import, because that process does little else."""

from __future__ import annotations

import struct
from typing import Final

FRAME: Final = struct.Struct("<cBqI")
"""Kind of frame, channel, time, length of what follows."""
OPEN, MESSAGE, CLOSE, QUIT = b"O", b"M", b"C", b"Q"
"""Kinds. The first ``OPEN`` describes the channels of all logs; ``QUIT`` is the last frame, sent or not."""


def frame(kind: bytes, content: bytes = b"") -> bytes:
    """A frame that is no message."""
    return FRAME.pack(kind, 0, 0, len(content)) + content


def message_frame(channel: int, time_ns: int, payload: bytes) -> bytes:
    """A message for the open log."""
    return FRAME.pack(MESSAGE, channel, time_ns, len(payload)) + payload


def messages_in(frames: bytes) -> list[tuple[int, int, bytes]]:
    """Channel, time and payload of the message frames."""
    found, at = [], 0
    while at < len(frames):
        _, channel, time_ns, length = FRAME.unpack_from(frames, at)
        at += FRAME.size
        found.append((channel, time_ns, frames[at : at + length]))
        at += length
    return found
