"""The supervisor's states, as one table. A trip latches: only a person's acknowledgement leads out of it."""

from __future__ import annotations

import enum
from typing import Final


class Guard(enum.Enum):
    """States of the supervisor."""

    READY = "ready"
    ACTIVE = "active"
    TRIPPED_RETRACTING = "tripped, retracting"
    TRIPPED_HOLDING = "tripped, holding"


class Cue(enum.Enum):
    """What moves it from state to state."""

    BEGIN = "begin()"
    TRIP_AND_RETRACT = "trip, retracting"
    TRIP_AND_HOLD = "trip, holding"
    ARRIVE = "end of the retraction"
    ACKNOWLEDGE = "acknowledge()"


TRANSITIONS: Final[dict[tuple[Guard, Cue], Guard]] = {
    (Guard.READY, Cue.BEGIN): Guard.ACTIVE,
    (Guard.ACTIVE, Cue.BEGIN): Guard.ACTIVE,
    (Guard.ACTIVE, Cue.TRIP_AND_RETRACT): Guard.TRIPPED_RETRACTING,
    (Guard.ACTIVE, Cue.TRIP_AND_HOLD): Guard.TRIPPED_HOLDING,
    (Guard.TRIPPED_RETRACTING, Cue.ARRIVE): Guard.TRIPPED_HOLDING,
    # A retraction may have been cut short by an exception; a person may acknowledge that too.
    (Guard.TRIPPED_RETRACTING, Cue.ACKNOWLEDGE): Guard.READY,
    (Guard.TRIPPED_HOLDING, Cue.ACKNOWLEDGE): Guard.READY,
}
