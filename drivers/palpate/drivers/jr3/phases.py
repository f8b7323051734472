"""The conversation with the board as a table: which cue leads from which phase to which.

::

    CLOSED -> PINGING -> READING_SCALES -> STOPPING -> STARTING -> AWAITING -> STREAMING <-> SILENT
                               |                                                |     ^
                               +-> IDENTIFIED (only asked who it is)         SETTLING -> ZEROING
    BOOTED leads from anywhere back to PINGING, LINK_LOST and GAVE_UP to FAULTED, ASKED_TO_STOP to LEAVING and CLOSED.

The stream is stopped before it is started. FACT: STOP ends the board's sampling thread, which holds the offsets, so
that a stream never begins with a zero that somebody else has set.
"""

from __future__ import annotations

import enum
from types import MappingProxyType

from palpate.drivers.jr3.messages import Op


class Phase(enum.Enum):
    """Where the conversation stands."""

    CLOSED = "closed"
    PINGING = "asking for the state"
    READING_SCALES = "reading full scales"
    IDENTIFIED = "identified"
    STOPPING = "stopping an old stream"
    STARTING = "starting the stream"
    AWAITING = "waiting for the first reading"
    STREAMING = "streaming"
    SETTLING = "waiting before zeroing"
    ZEROING = "zeroing"
    SILENT = "silent"
    LEAVING = "stopping the stream"
    FAULTED = "faulted"


class Cue(enum.Enum):
    """What may happen."""

    ASKED_TO_OPEN = "asked to open"
    ASKED_TO_ZERO = "asked to zero"
    ASKED_TO_STOP = "asked to stop"
    DONE = "request done"
    ALL_ASKED = "all there is to know is known"
    RETRIED = "asking again"
    SETTLED = "waited long enough"
    READ = "a reading came"
    STALLED = "no reading came"
    BOOTED = "the board started"
    GAVE_UP = "the board does not do as asked"
    LINK_LOST = "the way to the board is gone"


_TALKING = (Phase.PINGING, Phase.READING_SCALES, Phase.STOPPING, Phase.STARTING)
_FLOWING = (Phase.AWAITING, Phase.STREAMING, Phase.SETTLING, Phase.ZEROING)
_ALIVE = (*_TALKING, *_FLOWING, Phase.IDENTIFIED, Phase.SILENT)

TRANSITIONS = MappingProxyType(
    {
        **{
            (phase, Cue.ASKED_TO_OPEN): Phase.PINGING
            for phase in (Phase.CLOSED, Phase.IDENTIFIED, Phase.SILENT, Phase.FAULTED)
        },
        **{(phase, Cue.ASKED_TO_STOP): Phase.LEAVING for phase in _ALIVE},
        **{(phase, Cue.BOOTED): Phase.PINGING for phase in _ALIVE},
        **{(phase, Cue.GAVE_UP): Phase.FAULTED for phase in _ALIVE},
        **{(phase, Cue.LINK_LOST): Phase.FAULTED for phase in (*_ALIVE, Phase.LEAVING)},
        **{(phase, Cue.STALLED): Phase.SILENT for phase in _FLOWING},
        (Phase.FAULTED, Cue.ASKED_TO_STOP): Phase.CLOSED,
        (Phase.PINGING, Cue.DONE): Phase.READING_SCALES,
        (Phase.READING_SCALES, Cue.DONE): Phase.STOPPING,
        (Phase.READING_SCALES, Cue.ALL_ASKED): Phase.IDENTIFIED,
        (Phase.READING_SCALES, Cue.RETRIED): Phase.PINGING,
        (Phase.STOPPING, Cue.DONE): Phase.STARTING,
        (Phase.STARTING, Cue.DONE): Phase.AWAITING,
        (Phase.AWAITING, Cue.READ): Phase.STREAMING,
        (Phase.SILENT, Cue.READ): Phase.STREAMING,
        (Phase.STREAMING, Cue.ASKED_TO_ZERO): Phase.SETTLING,
        (Phase.SETTLING, Cue.SETTLED): Phase.ZEROING,
        (Phase.ZEROING, Cue.DONE): Phase.STREAMING,
        (Phase.LEAVING, Cue.DONE): Phase.CLOSED,
        (Phase.LEAVING, Cue.GAVE_UP): Phase.CLOSED,
        (Phase.LEAVING, Cue.BOOTED): Phase.CLOSED,
    }
)
"""Where each cue leads. A pair that is not here means nothing: an event is ignored, a wish refused."""

REQUESTS = MappingProxyType(
    {
        Phase.PINGING: Op.GET_STATE,
        Phase.STOPPING: Op.STOP,
        Phase.STARTING: Op.START,
        Phase.ZEROING: Op.ZERO,
        Phase.LEAVING: Op.STOP,
    }
)
"""What is asked on entering a phase; the full scales are asked one after another by the conversation."""

READABLE = frozenset({*_FLOWING, Phase.SILENT})
"""Phases in which readings are samples; in all others they belong to an older stream."""

FLOWING = frozenset(_FLOWING)
"""Phases in which readings must keep coming."""
