"""The sections of a tick."""

from __future__ import annotations

import enum
from typing import Final


class TickSection(enum.IntEnum):
    """What a tick's time is spent on. The numbers are columns; together they make up the tick."""

    CLOCK = 0
    FORCE = 1
    JOINTS = 2
    PERCEIVE = 3
    DECIDE = 4
    CONTROL = 5
    SEND = 6
    RECORD = 7
    REST = 8


SECTIONS: Final = len(TickSection)
BUSY: Final = SECTIONS
"""Column of a whole tick, from waking to the next sleep."""
LATE: Final = SECTIONS + 1
"""Column of how late ticks began."""
COLUMNS: Final = SECTIONS + 2

NAMES: Final = (
    "clock", "read force", "read joints", "perceive", "decide", "control", "send", "record", "rest",
    "whole tick", "lateness",
)  # fmt: skip
"""Names of the columns."""

CORE: Final = (TickSection.PERCEIVE, TickSection.DECIDE, TickSection.CONTROL)
"""What the core's parts spend."""
