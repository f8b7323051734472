"""What a process and the process that watches it say to each other: single bytes over two pipes."""

from __future__ import annotations

from typing import Final

FED: Final = b"f"
RESTING: Final = b"r"
ACKNOWLEDGED: Final = b"a"
QUIT: Final = b"q"
READY: Final = b"R"
TRIPPED: Final = b"T"
