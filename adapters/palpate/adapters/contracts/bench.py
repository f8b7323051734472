"""Test rigs and clause failures. A rig has an adapter and the controls that a clause uses to act on the world.

A control that is None does not exist on this rig. The clauses that need it are reported as not applicable. A simulator,
for example, may be unable to stop sending, and a real arm has no control that provokes a fault.
"""

import re
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from math import ceil
from typing import Generic, TypeVar
from unittest import SkipTest

from typing_extensions import override

from palpate.core.ports import (
    CONTROL_RATE_HZ,
    SENSOR_FRAME,
    ArmCommand,
    Clock,
    Device,
    ForceSensor,
    JointEncoder,
    JointVector,
    WrenchKind,
)

T = TypeVar("T")
DeviceT = TypeVar("DeviceT", bound=Device)


class ContractViolation(AssertionError):  # noqa: N818 - it reports a finding, like a failed assertion
    """An adapter violates a clause in its port's contract."""

    def __init__(self, clause: str, observed: str, wanted: str) -> None:
        self.observed, self.wanted = observed, wanted
        super().__init__(f"{clause}: observed {observed}; the contract wants {wanted}")


class ClauseNotApplicable(SkipTest):
    """The rig lacks a control that the clause needs. pytest reports the clause as skipped."""


@dataclass(frozen=True, kw_only=True)
class DeviceRig(Generic[DeviceT]):
    """Base class for rigs with a device port.

    Attributes:
        advance: Function that advances world and time by a number of control ticks, in every adapter state.
        is_open: Function that returns True if the adapter holds a connection or another resource.
        provoke_fault: Function that makes the active device fail and returns once the adapter has latched the fault.
        disconnect: Function that disconnects the cable, in any adapter state.
        reconnect: Function that reconnects the cable after ``disconnect``.
        dispose: Function that releases the rig's own resources after the adapter has been closed.
        call_budget_ns: Maximum duration of a reading or a command.
        runs_by_itself: True if the world keeps running between calls, as with real hardware.
        settle_ticks: Number of ticks after which a small move is complete, or a reading reflects a change.
    """

    device: DeviceT
    clock: Clock
    advance: Callable[[int], None]
    is_open: Callable[[], bool] | None = None
    provoke_fault: Callable[[], None] | None = None
    disconnect: Callable[[], None] | None = None
    reconnect: Callable[[], None] | None = None
    dispose: Callable[[], None] = lambda: None
    call_budget_ns: int = 10**9 // CONTROL_RATE_HZ
    runs_by_itself: bool = False
    settle_ticks: int = 1

    @property
    def all_devices(self) -> tuple[Device, ...]:
        """All adapters that must be closed after the clause."""
        return (self.device,)

    @property
    def timeout_ns(self) -> int:
        """Time within which the adapter must detect a lost device."""
        return 0

    def pass_time(self, duration_ns: int) -> None:
        """Advance by more than ``duration_ns``, one tick at a time.

        Raises:
            ContractViolation: The rig's clock does not advance.
        """
        start_ns = self.clock.now_ns()
        while (before_ns := self.clock.now_ns()) <= start_ns + duration_ns:
            self.advance(1)
            require("rig", self.clock.now_ns() > before_ns, "a clock that does not advance", "advance() to pass time")


@dataclass(frozen=True, kw_only=True)
class SensorRig(DeviceRig[DeviceT]):
    """Base class for rigs with a sensor port.

    Attributes:
        max_age_ns: Maximum age of a ``VALID`` sample.
        go_silent: Function that makes the device stop sending without an error.
    """

    max_age_ns: int
    go_silent: Callable[[], None] | None = None

    @property
    @override
    def timeout_ns(self) -> int:
        return self.max_age_ns


@dataclass(frozen=True, kw_only=True)
class ForceSensorRig(SensorRig[ForceSensor]):
    """A force sensor on the test bench.

    Attributes:
        push_N: Function that exerts a force (fx, fy, fz) on the tool, in the sensor frame, until the next call. (0, 0,
            -10) represents a surface that presses against the tool axis. It must also work before ``configure``.
        load_N: Force that is safe and well within the range.
        overload_N: Force that may exceed the range but causes no damage on this rig.
        tolerance_N: Maximum error, including noise, of a settled reading.
        kind: Compensation that the adapter declares for its wrench.
        twist_Nm: Function that exerts an additional torque on the tool, in the same way as ``push_N``.
        load_Nm: Torque that is safe and well within the range.
        overload_Nm: Torque that may exceed the range but causes no damage on this rig.
        tolerance_Nm: Maximum error, including noise, of a settled reading.
        frame: Frame that the adapter declares for the wrench.
    """

    push_N: Callable[[float, float, float], None] | None = None
    load_N: float = 10.0
    overload_N: float | None = None
    tolerance_N: float = 1e-6
    kind: WrenchKind = WrenchKind.RAW
    twist_Nm: Callable[[float, float, float], None] | None = None
    load_Nm: float = 1.0
    overload_Nm: float | None = None
    tolerance_Nm: float = 1e-6
    frame: str = SENSOR_FRAME


@dataclass(frozen=True, kw_only=True)
class MovingRig(DeviceRig[DeviceT]):
    """Base class for rigs with one of an arm's two ports.

    Attributes:
        step_rad: Motion per tick that is permitted for every joint in both directions.
        tolerance_rad: Maximum difference between a stationary arm and its command, or between an encoder and its joint;
            less than half of ``step_rad``.
    """

    step_rad: float = 1e-3
    tolerance_rad: float = 1e-6


@dataclass(frozen=True, kw_only=True)
class JointEncoderRig(SensorRig[JointEncoder], MovingRig[JointEncoder]):
    """A joint encoder on the test bench.

    Attributes:
        expected_rad: True joint angles, (n,), if they are known.
        arm: Arm that moves these joints, newly constructed. It is the same object as ``device`` if one adapter serves
            both ports.
    """

    joints: int
    expected_rad: JointVector | None = None
    arm: ArmCommand | None = None

    @property
    @override
    def all_devices(self) -> tuple[Device, ...]:
        return (self.device,) if self.arm is None else (self.device, self.arm)


@dataclass(frozen=True, kw_only=True)
class ArmCommandRig(MovingRig[ArmCommand]):
    """An arm on the test bench.

    Attributes:
        home_rad: Initial joint angles, (n,), within the limits. If one joint is close to a limit, the clause on
            position limits runs quickly.
        lower_rad: Lower position limits, (n,).
        upper_rad: Upper position limits, (n,).
        fast_step_rad: Motion per tick that is too fast; in the home pose, at least one joint has room for it.
        position_rad: Function that returns the true joint angles, (n,).
        turn_by_hand: Function that moves the joints of the inactive arm to these angles from outside.
        stop_budget_ns: Maximum duration of ``stop``.
        limit_ticks: Maximum number of ticks by which the arm may lag on its way to the nearest position limit.
    """

    home_rad: JointVector
    lower_rad: JointVector
    upper_rad: JointVector
    fast_step_rad: float
    position_rad: Callable[[], JointVector] | None = None
    turn_by_hand: Callable[[JointVector], None] | None = None
    stop_budget_ns: int = 100_000_000
    limit_ticks: int = 2000


def parameter(value: T | None, name: str) -> T:
    """Return one of the rig's optional controls.

    Raises:
        ClauseNotApplicable: The rig has no such control.
    """
    if value is None:
        raise ClauseNotApplicable(f"this rig has no {name}: {_described(name)}")
    return value


def _described(name: str) -> str:
    """Return a control's description from the rig class's docstring, on one line."""
    texts = "\n".join(
        kind.__doc__ or "" for kind in (DeviceRig, SensorRig, ForceSensorRig, JointEncoderRig, ArmCommandRig)
    )
    found = re.search(rf"^ +{name}: (.+?)\n(?: +\w+: |    \n| *$)", texts, re.DOTALL | re.MULTILINE)
    return " ".join(found[1].split()) if found else "see the attributes of the rig"


def require(clause: str, holds: bool, observed: str, wanted: str) -> None:
    """Fail the clause unless ``holds`` is true."""
    if not holds:
        raise ContractViolation(clause, observed, wanted)


def require_raises(clause: str, kind: type[Exception], action: Callable[[], object], wanted: str) -> None:
    """Fail the clause unless ``action`` raises this kind of error; other errors propagate."""
    with suppress(kind):
        raise ContractViolation(clause, f"no error, but {action()!r}", wanted)


def ramp(begin_rad: JointVector, end_rad: JointVector, step_rad: float) -> Iterator[JointVector]:
    """Yield a path to another pose in steps of at most ``step_rad`` per joint; all joints arrive together."""
    far = max((abs(e - b) for b, e in zip(begin_rad, end_rad, strict=True)), default=0.0)
    # A rounding error must not turn a one-step path into two steps.
    steps = ceil(far / step_rad - 1e-6)
    for k in range(1, steps):
        yield tuple(b + k / steps * (e - b) for b, e in zip(begin_rad, end_rad, strict=True))
    if steps:
        yield end_rad
