"""Zebra Zero arm faults and how they are detected in replies."""

import enum
from typing import Final

from palpate.drivers.errors import DeviceFaultError
from palpate.drivers.nmc import Aux, NmcStatus, Reply
from palpate.drivers.zebra_zero.codec import DEVICE
from palpate.drivers.zebra_zero.settings import ZebraZeroSettings


class FaultKind(enum.Enum):
    """Kinds of arm fault."""

    POSITION_ERROR = "position error: the firmware switched the servo off"
    OVERCURRENT = "overcurrent"
    LIMIT_INPUT = "a limit input is set"
    POWER_LOST = "motor supply is off"
    SERVO_OFF = "the servo is off and should be on"
    SERVO_OVERRUN = "the servo loop of the module overran"
    POSITION_WRAP = "the position counter wrapped"
    OUT_OF_LIMITS = "measured pose is beyond a joint limit"


TRIPPED: Final = (FaultKind.POSITION_ERROR, FaultKind.OVERCURRENT, FaultKind.SERVO_OFF)
"""Faults that make the firmware switch a motor off; a stop must not switch it on again."""

_BY_HAND: Final = "switch the motors off, move the joint back by hand, then acknowledge"
_REMEDIES: Final = {
    FaultKind.POSITION_ERROR: "see what holds the arm up, then acknowledge",
    FaultKind.OVERCURRENT: "see what holds the arm up, then acknowledge",
    FaultKind.LIMIT_INPUT: f"{_BY_HAND}; or set use_limit_inputs = false where no switch is wired",
    FaultKind.POWER_LOST: "check emergency stop and motor supply, then acknowledge; or set require_power = false"
    " where amplifiers never report it",
    FaultKind.OUT_OF_LIMITS: _BY_HAND,
}


class ArmFaultError(DeviceFaultError):
    """A fault in the arm or in one motor, 1 to 6."""

    def __init__(self, kind: FaultKind, axis: int | None, detail: str = "") -> None:
        self.kind, self.axis = kind, axis
        where = "" if axis is None else f"motor {axis}: "
        problem = where + kind.value + (f" ({detail})" if detail else "")
        super().__init__(DEVICE, problem, _REMEDIES.get(kind, "acknowledge"))


def fault_in(axis: int, reply: Reply, settings: ZebraZeroSettings, *, should_be_on: bool) -> ArmFaultError | None:
    """Return the most serious fault in a reply, or None.

    Args:
        axis: Motor, 1 to 6.
        should_be_on: True if the servo should be on; otherwise, its position error bit and supply have no meaning.
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
    return next((ArmFaultError(kind, axis) for is_shown, kind in shown if is_shown), None)
