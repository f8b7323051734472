"""A gamepad that is a named pipe, with the records of Linux's joystick interface."""

import os
import struct
from pathlib import Path

BUTTON, AXIS, INITIAL = 1, 2, 0x80


class Pad:
    """The other end."""

    def __init__(self, path: Path) -> None:
        os.mkfifo(path)
        self.path, self.fd = path, os.open(path, os.O_RDWR)

    def event(self, kind: int, number: int, value: int) -> bytes:
        return struct.pack("=IhBB", 12345, value, kind, number)

    def send(self, kind: int, number: int, value: int) -> None:
        os.write(self.fd, self.event(kind, number, value))
