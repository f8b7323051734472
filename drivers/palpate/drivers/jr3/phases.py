"""The conversation with the board as a table of states, and its one request in flight.

::

    CLOSED -> PINGING -> READING_SCALES -> STOPPING -> STARTING -> AWAITING -> STREAMING <-> SILENT
    BOOTED leads from anywhere back to PINGING, LINK_LOST and GAVE_UP to FAULTED, ASKED_TO_STOP to LEAVING and CLOSED.

The stream is stopped before it is started. FACT: STOP ends the board's sampling thread, which holds the offsets, so
that a stream never begins with a zero that another client has set.
"""

import enum
from types import MappingProxyType

from palpate.drivers.jr3.messages import SCALES_IN_REPLY, Ack, Op


class Jr3Phase(enum.Enum):
    """Where the conversation stands."""

    CLOSED = "closed"
    PINGING = "asking for the state"
    READING_SCALES = "reading full scales"
    STOPPING = "stopping an old stream"
    STARTING = "starting the stream"
    AWAITING = "waiting for the first reading"
    STREAMING = "streaming"
    SILENT = "silent"
    LEAVING = "stopping the stream"
    FAULTED = "faulted"


class Jr3Event(enum.Enum):
    """What may happen."""

    ASKED_TO_OPEN = "asked to open"
    ASKED_TO_STOP = "asked to stop"
    DONE = "request done"
    RETRIED = "asking again"
    READ = "a reading came"
    STALLED = "no reading came"
    BOOTED = "the board started"
    GAVE_UP = "the board does not do as asked"
    LINK_LOST = "the way to the board is gone"


_TALKING = (Jr3Phase.PINGING, Jr3Phase.READING_SCALES, Jr3Phase.STOPPING, Jr3Phase.STARTING)
_FLOWING = (Jr3Phase.AWAITING, Jr3Phase.STREAMING)
_ALIVE = (*_TALKING, *_FLOWING, Jr3Phase.SILENT)

TRANSITIONS = MappingProxyType(
    {
        **{
            (phase, Jr3Event.ASKED_TO_OPEN): Jr3Phase.PINGING
            for phase in (Jr3Phase.CLOSED, Jr3Phase.SILENT, Jr3Phase.FAULTED)
        },
        **{(phase, Jr3Event.ASKED_TO_STOP): Jr3Phase.LEAVING for phase in _ALIVE},
        **{(phase, Jr3Event.BOOTED): Jr3Phase.PINGING for phase in _ALIVE},
        **{(phase, Jr3Event.GAVE_UP): Jr3Phase.FAULTED for phase in _ALIVE},
        **{(phase, Jr3Event.LINK_LOST): Jr3Phase.FAULTED for phase in (*_ALIVE, Jr3Phase.LEAVING)},
        **{(phase, Jr3Event.STALLED): Jr3Phase.SILENT for phase in _FLOWING},
        (Jr3Phase.FAULTED, Jr3Event.ASKED_TO_STOP): Jr3Phase.CLOSED,
        (Jr3Phase.PINGING, Jr3Event.DONE): Jr3Phase.READING_SCALES,
        (Jr3Phase.READING_SCALES, Jr3Event.DONE): Jr3Phase.STOPPING,
        (Jr3Phase.READING_SCALES, Jr3Event.RETRIED): Jr3Phase.PINGING,
        (Jr3Phase.STOPPING, Jr3Event.DONE): Jr3Phase.STARTING,
        (Jr3Phase.STARTING, Jr3Event.DONE): Jr3Phase.AWAITING,
        (Jr3Phase.AWAITING, Jr3Event.READ): Jr3Phase.STREAMING,
        (Jr3Phase.SILENT, Jr3Event.READ): Jr3Phase.STREAMING,
        (Jr3Phase.LEAVING, Jr3Event.DONE): Jr3Phase.CLOSED,
        (Jr3Phase.LEAVING, Jr3Event.GAVE_UP): Jr3Phase.CLOSED,
        (Jr3Phase.LEAVING, Jr3Event.BOOTED): Jr3Phase.CLOSED,
    }
)
"""Where each cue leads. A pair that is not here means nothing: an event is ignored, a wish refused."""

REQUESTS = MappingProxyType(
    {
        Jr3Phase.PINGING: Op.GET_STATE,
        Jr3Phase.STOPPING: Op.STOP,
        Jr3Phase.STARTING: Op.START,
        Jr3Phase.LEAVING: Op.STOP,
    }
)
"""What is asked on entering a phase; the full scales are asked one after another by the conversation."""

READABLE = frozenset({*_FLOWING, Jr3Phase.SILENT})
"""Phases in which readings are samples; in all others they belong to an older stream."""

FLOWING = frozenset(_FLOWING)
"""Phases in which readings must keep coming."""


class RequestInFlight:
    """Keeps the only request that may be in flight.

    An acknowledgement that says "not initialised" does not end the request: it is repeated after its time-out, because
    a board that is still booting answers like that, and whatever else such an answer carries is stale (FACT).

    Attributes:
        request: In flight or waiting to be sent; None when there is none.
    """

    def __init__(self) -> None:
        self.request: Op | None = None
        self.refused = False
        self._attempts_left = 0
        self._sent_ns: int | None = None
        self._timeout_ns = 0

    def begin(self, request: Op, attempts: int, timeout_ns: int) -> None:
        """Put a request in place of any before it; :meth:`due` then says when to send it."""
        self.request, self._attempts_left, self._timeout_ns = request, attempts, timeout_ns
        self._sent_ns, self.refused = None, False

    def cancel(self) -> None:
        """Forget the request; its acknowledgement will be a stray one."""
        self.request = None

    def due(self, now_ns: int) -> bool:
        """Whether the request must be sent now, for the first time or again; False when attempts are used up."""
        if self.request is None or self._attempts_left == 0 or not self._waited(now_ns):
            return False
        self._attempts_left -= 1
        self._sent_ns = now_ns
        return True

    def exhausted(self, now_ns: int) -> bool:
        """Whether the last attempt, too, has timed out; the request is then forgotten."""
        if self.request is None or self._attempts_left > 0 or not self._waited(now_ns):
            return False
        self.request = None
        return True

    def answer(self, ack: Ack) -> Op | None:
        """Take an acknowledgement; give back the request that it completes, or None."""
        request = self.request
        if request is None or self._sent_ns is None or len(ack.scales) != SCALES_IN_REPLY.get(request, 0):
            return None
        self.refused = not ack.ready
        if self.refused:
            return None
        self.request = None
        return request

    def _waited(self, now_ns: int) -> bool:
        return self._sent_ns is None or now_ns - self._sent_ns >= self._timeout_ns
