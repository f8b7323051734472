"""State machine for communication with the board, and its pending request.

::

    CLOSED -> PINGING -> READING_SCALES -> STOPPING -> STARTING -> AWAITING -> STREAMING <-> SILENT
    BOOTED leads from anywhere back to PINGING, LINK_LOST and GAVE_UP to FAULTED, STOP_REQUESTED to LEAVING and CLOSED.

The stream is stopped before it is started. FACT: STOP ends the board's sampling thread, which holds the offsets, so a
stream never starts with a zero that another client has set.
"""

import enum
from types import MappingProxyType

from palpate.drivers.jr3.messages import SCALES_IN_REPLY, Ack, Op


class Jr3Phase(enum.Enum):
    """Phases of the communication."""

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
    """Events that change the phase."""

    OPEN_REQUESTED = "asked to open"
    STOP_REQUESTED = "asked to stop"
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
            (phase, Jr3Event.OPEN_REQUESTED): Jr3Phase.PINGING
            for phase in (Jr3Phase.CLOSED, Jr3Phase.SILENT, Jr3Phase.FAULTED)
        },
        **{(phase, Jr3Event.STOP_REQUESTED): Jr3Phase.LEAVING for phase in _ALIVE},
        **{(phase, Jr3Event.BOOTED): Jr3Phase.PINGING for phase in _ALIVE},
        **{(phase, Jr3Event.GAVE_UP): Jr3Phase.FAULTED for phase in _ALIVE},
        **{(phase, Jr3Event.LINK_LOST): Jr3Phase.FAULTED for phase in (*_ALIVE, Jr3Phase.LEAVING)},
        **{(phase, Jr3Event.STALLED): Jr3Phase.SILENT for phase in _FLOWING},
        (Jr3Phase.FAULTED, Jr3Event.STOP_REQUESTED): Jr3Phase.CLOSED,
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
"""Next phase for each phase and event. In other combinations, events are ignored and requests are rejected."""

REQUESTS = MappingProxyType(
    {
        Jr3Phase.PINGING: Op.GET_STATE,
        Jr3Phase.STOPPING: Op.STOP,
        Jr3Phase.STARTING: Op.START,
        Jr3Phase.LEAVING: Op.STOP,
    }
)
"""Request that is sent on entering a phase; the full-scale values are requested one after the other."""

READABLE = frozenset({*_FLOWING, Jr3Phase.SILENT})
"""Phases in which readings become samples; in other phases, readings belong to an older stream."""

FLOWING = frozenset(_FLOWING)
"""Phases in which readings are expected."""


class RequestInFlight:
    """Holder of the single pending request.

    An acknowledgement with "not initialised" does not complete the request, which is repeated after its time-out. A
    booting board sends such acknowledgements, whose other fields are stale (FACT).
    """

    def __init__(self) -> None:
        self.request: Op | None = None
        self.refused = False
        self._attempts_left = 0
        self._sent_ns: int | None = None
        self._timeout_ns = 0

    def begin(self, request: Op, attempts: int, timeout_ns: int) -> None:
        """Replace the pending request with a new one, to be sent when :meth:`due` returns True."""
        self.request, self._attempts_left, self._timeout_ns = request, attempts, timeout_ns
        self._sent_ns, self.refused = None, False

    def cancel(self) -> None:
        """Drop the request; its acknowledgement will be ignored as unexpected."""
        self.request = None

    def due(self, now_ns: int) -> bool:
        """Return True if the request must be sent now, for the first time or again; False after the last attempt."""
        if self.request is None or self._attempts_left == 0 or not self._waited(now_ns):
            return False
        self._attempts_left -= 1
        self._sent_ns = now_ns
        return True

    def exhausted(self, now_ns: int) -> bool:
        """Drop the request and return True if the last attempt has timed out."""
        if self.request is None or self._attempts_left > 0 or not self._waited(now_ns):
            return False
        self.request = None
        return True

    def answer(self, ack: Ack) -> Op | None:
        """Process an acknowledgement and return the request that it completes, or None."""
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
