"""One request in flight: its acknowledgement, its time-outs and its attempts, without a clock of its own."""

from __future__ import annotations

from collections import deque

from palpate.drivers.jr3.messages import SCALES_IN_REPLY, Ack, Request

_REMEMBERED = 256


class Exchange:
    """Keeps the only request that may be in flight.

    An acknowledgement that says "not initialised" does not end the request: it is repeated after its time-out, because
    a board that is still booting answers like that, and whatever else such an answer carries is stale (FACT).

    Attributes:
        request: In flight or waiting to be sent; None when there is none.
        refused: Whether the last answer to it was "not initialised".
        timeouts: Requests that were not answered in time.
        strays: Acknowledgements that answer nothing: late ones, and ones of the wrong length.
    """

    def __init__(self) -> None:
        self.request: Request | None = None
        self.refused = False
        self.timeouts = self.strays = 0
        self._attempts_left = 0
        self._sent_ns: int | None = None
        self._timeout_ns = 0
        self._round_trips_ns: deque[int] = deque(maxlen=_REMEMBERED)

    def begin(self, request: Request, attempts: int, timeout_ns: int) -> None:
        """Put a request in place of any before it; :meth:`due` then tells when to send it."""
        self.request, self._attempts_left, self._timeout_ns = request, attempts, timeout_ns
        self._sent_ns, self.refused = None, False

    def cancel(self) -> None:
        """Forget the request; its acknowledgement will be a stray one."""
        self.request = None

    def due(self, now_ns: int) -> bool:
        """Whether the request must be sent now, for the first time or again; False when attempts are used up."""
        if self.request is None or self._attempts_left == 0 or not self._waited(now_ns):
            return False
        self._note_timeout()
        self._attempts_left -= 1
        self._sent_ns = now_ns
        return True

    def exhausted(self, now_ns: int) -> bool:
        """Whether the last attempt, too, has timed out; the request is then forgotten."""
        if self.request is None or self._attempts_left > 0 or not self._waited(now_ns):
            return False
        self._note_timeout()
        self.request = None
        return True

    def answer(self, ack: Ack, now_ns: int) -> Request | None:
        """Take an acknowledgement; give back the request that it completes, or None."""
        request = self.request
        if request is None or self._sent_ns is None or len(ack.scales) != SCALES_IN_REPLY.get(request.op, 0):
            self.strays += 1
            return None
        self.refused = not ack.ready
        if self.refused:
            return None
        self._round_trips_ns.append(now_ns - self._sent_ns)
        self.request = None
        return request

    def round_trips_ns(self) -> tuple[int, ...]:
        """The last round trips, sorted, in ns; as coarse as the polling."""
        return tuple(sorted(self._round_trips_ns))

    def _waited(self, now_ns: int) -> bool:
        return self._sent_ns is None or now_ns - self._sent_ns >= self._timeout_ns

    def _note_timeout(self) -> None:
        self.timeouts += self._sent_ns is not None and not self.refused
