"""What a tick is made of, and what is timed of it."""

import enum
from typing import Final


class TickSection(enum.IntEnum):
    """What a tick's time is spent on, in its order. The numbers are columns; together they make up the tick."""

    CLOCK = 0
    FORCE = 1
    JOINTS = 2
    PERCEIVE = 3
    """From the snapshot to the task frame, and on in the phase; symbol, state and learning where an action ends."""
    DECIDE = 4
    """The policy's choice, in the ticks in which one is due."""
    CONTROL = 5
    """Reference and inverse kinematics."""
    SUPERVISE = 6
    SEND = 7
    RECORD = 8
    REST = 9


SECTIONS: Final = len(TickSection)
BUSY: Final = SECTIONS
"""Column of a whole tick, from waking to its end."""
LATE: Final = SECTIONS + 1
"""Column of how late ticks began."""
COLUMNS: Final = SECTIONS + 2

NAMES: Final = (
    "clock", "read force", "read joints", "perceive", "decide", "control", "supervise", "send", "record", "rest",
    "whole tick", "lateness",
)  # fmt: skip
"""Names of the columns."""
