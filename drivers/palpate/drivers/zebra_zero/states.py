"""The states of the arm as one table, its faults and how they show in a reply."""

import enum
from dataclasses import dataclass
from typing import Final

from palpate.drivers.device import Measured
from palpate.drivers.errors import DeviceFaultError, StateError
from palpate.drivers.nmc import Aux, NmcStatus, Reply
from palpate.drivers.zebra_zero.codec import DEVICE, SixCounts
from palpate.drivers.zebra_zero.settings import ZebraZeroSettings


class ZebraState(enum.Enum):
    """Where the arm is in its life."""

    CLOSED = "closed"
    CONNECTED = "connected, position unknown"
    HOMED = "position known"
    SERVO_ON = "servos on"
    STOPPING = "stopping"
    STOPPED = "stopped"
    FAULTED = "faulted"


class ZebraEvent(enum.Enum):
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


TRANSITIONS: Final[dict[tuple[ZebraState, ZebraEvent], ZebraState]] = {
    (ZebraState.CLOSED, ZebraEvent.CONNECT): ZebraState.CONNECTED,
    (ZebraState.CONNECTED, ZebraEvent.REFERENCE): ZebraState.HOMED,
    (ZebraState.HOMED, ZebraEvent.ENABLE): ZebraState.SERVO_ON,
    (ZebraState.STOPPED, ZebraEvent.ENABLE): ZebraState.SERVO_ON,
    (ZebraState.SERVO_ON, ZebraEvent.STOP): ZebraState.STOPPING,
    (ZebraState.STOPPING, ZebraEvent.AT_REST): ZebraState.STOPPED,
    (ZebraState.STOPPED, ZebraEvent.RELEASE): ZebraState.HOMED,
    (ZebraState.FAULTED, ZebraEvent.ACKNOWLEDGE): ZebraState.STOPPED,
    **{(state, ZebraEvent.FAULT): ZebraState.FAULTED for state in ZebraState if state is not ZebraState.CLOSED},
    **{(state, ZebraEvent.CLOSE): ZebraState.CLOSED for state in ZebraState},
}


def after(state: ZebraState, event: ZebraEvent) -> ZebraState:
    """The state that follows."""
    following = TRANSITIONS.get((state, event))
    if following is None:
        allowed = ", ".join(before.value for before, known in TRANSITIONS if known is event)
        raise StateError(DEVICE, f"cannot {event.value} while {state.value}", f"possible while: {allowed}")
    return following


class FaultKind(enum.Enum):
    """What went wrong."""

    POSITION_ERROR = "position error: the firmware switched the servo off"
    OVERCURRENT = "overcurrent"
    LIMIT_INPUT = "a limit input is set"
    POWER_LOST = "motor supply is off"
    SERVO_OFF = "the servo is off and should be on"
    SERVO_OVERRUN = "the servo loop of the module overran"
    POSITION_WRAP = "the position counter wrapped"
    OUT_OF_LIMITS = "measured pose is beyond a joint limit"
    COMMUNICATION = "communication failed"
    STOP_NOT_SEEN = "the arm was not seen to come to rest"


_REMEDIES = {
    FaultKind.POSITION_ERROR: "see what holds the arm up, then acknowledge",
    FaultKind.OVERCURRENT: "see what holds the arm up, then acknowledge",
    FaultKind.LIMIT_INPUT: "release the motors, move the joint back by hand, then acknowledge; or set"
    " use_limit_inputs = false where no switch is wired",
    FaultKind.POWER_LOST: "check emergency stop and motor supply, then acknowledge; or set require_power = false"
    " where amplifiers never report it",
    FaultKind.OUT_OF_LIMITS: "release the motors, move the joint back by hand, then acknowledge",
    FaultKind.COMMUNICATION: "check cable and supply, then acknowledge",
    FaultKind.STOP_NOT_SEEN: "make sure that the arm stands still, then acknowledge",
}


@dataclass(frozen=True, slots=True)
class Fault:
    """A latched fault.

    Attributes:
        axis: Motor, 1 to 6; None when no single one.
    """

    kind: FaultKind
    axis: int | None = None
    detail: str = ""

    def __str__(self) -> str:
        where = "" if self.axis is None else f"motor {self.axis}: "
        return where + self.kind.value + (f" ({self.detail})" if self.detail else "")

    def error(self) -> DeviceFaultError:
        """The error for it."""
        return DeviceFaultError(DEVICE, str(self), _REMEDIES.get(self.kind, "acknowledge"))


def fault_in(axis: int, reply: Reply, settings: ZebraZeroSettings, *, should_be_on: bool) -> Fault | None:
    """The gravest fault that a reply shows, or None.

    Args:
        axis: Motor, 1 to 6.
        should_be_on: The servo is meant to be on; off, its position error bit and supply mean nothing.
    """
    aux = Aux(0) if reply.aux is None else reply.aux
    shown = (
        (reply.status & NmcStatus.OVERCURRENT, FaultKind.OVERCURRENT),
        (should_be_on and settings.require_power and not reply.status & NmcStatus.POWER_ON, FaultKind.POWER_LOST),
        (should_be_on and reply.status & NmcStatus.POS_ERROR, FaultKind.POSITION_ERROR),
        (settings.use_limit_inputs and reply.status & (NmcStatus.LIMIT1 | NmcStatus.LIMIT2), FaultKind.LIMIT_INPUT),
        (should_be_on and reply.aux is not None and not aux & Aux.SERVO_ON, FaultKind.SERVO_OFF),
        (aux & Aux.SERVO_OVERRUN, FaultKind.SERVO_OVERRUN),
        (aux & Aux.POS_WRAP, FaultKind.POSITION_WRAP),
    )
    return next((Fault(kind, axis) for is_shown, kind in shown if is_shown), None)


@dataclass(frozen=True, slots=True, kw_only=True)
class ZebraMeasured(Measured):
    """One cycle over all axes. The axes are read one after the other, between ``begin_ns`` and ``end_ns``.

    Attributes:
        counts: Counter values, (6,).
        status: Status bytes, (6,).
        aux: Auxiliary bytes, (6,); None where the reply had none.
    """

    counts: SixCounts
    status: tuple[NmcStatus, ...]
    aux: tuple[Aux | None, ...]
    begin_ns: int
    end_ns: int
