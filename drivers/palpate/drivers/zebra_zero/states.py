"""The states of the arm as one table."""

from __future__ import annotations

import enum
from typing import Final

from palpate.drivers.errors import StateError
from palpate.drivers.zebra_zero.counts import DEVICE


class State(enum.Enum):
    """Where the arm is in its life."""

    CLOSED = "closed"
    CONNECTED = "connected, position unknown"
    HOMED = "position known"
    SERVO_ON = "servos on"
    STOPPING = "stopping"
    STOPPED = "stopped"
    FAULTED = "faulted"


class Event(enum.Enum):
    """What takes it from one state to the next."""

    CONNECT = "connect"
    REFERENCE = "confirm or resume the position"
    ENABLE = "switch the servos on"
    STOP = "stop"
    AT_REST = "come to rest"
    RELEASE = "switch the motors off"
    FAULT = "fault"
    ACKNOWLEDGE = "acknowledge the fault"
    CLOSE = "close"


TRANSITIONS: Final[dict[tuple[State, Event], State]] = {
    (State.CLOSED, Event.CONNECT): State.CONNECTED,
    (State.CONNECTED, Event.REFERENCE): State.HOMED,
    (State.HOMED, Event.ENABLE): State.SERVO_ON,
    (State.STOPPED, Event.ENABLE): State.SERVO_ON,
    (State.SERVO_ON, Event.STOP): State.STOPPING,
    (State.STOPPING, Event.AT_REST): State.STOPPED,
    (State.STOPPED, Event.RELEASE): State.HOMED,
    (State.FAULTED, Event.ACKNOWLEDGE): State.STOPPED,
    **{(state, Event.FAULT): State.FAULTED for state in State if state is not State.CLOSED},
    **{(state, Event.CLOSE): State.CLOSED for state in State},
}


def after(state: State, event: Event) -> State:
    """The state that follows.

    Raises:
        StateError: The event is out of order.
    """
    following = TRANSITIONS.get((state, event))
    if following is None:
        allowed = ", ".join(before.value for before, known in TRANSITIONS if known is event)
        raise StateError(DEVICE, f"cannot {event.value} while {state.value}", f"possible while: {allowed}")
    return following
