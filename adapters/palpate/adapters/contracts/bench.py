"""Rigs: an adapter on the test bench with the knobs by which a clause acts on the world; how a clause fails.

A knob that is None does not exist on this rig, and the clauses that need it are reported as not applicable: a simulator
may be unable to fall silent, a real arm has nothing that provokes a fault.
"""

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
    """An adapter does not keep a clause of its port's contract."""

    def __init__(self, clause: str, observed: str, wanted: str) -> None:
        self.observed, self.wanted = observed, wanted
        super().__init__(f"{clause}: observed {observed}; the contract wants {wanted}")


class ClauseNotApplicable(SkipTest):
    """The rig lacks a knob that the clause needs. pytest reports the clause as skipped."""


@dataclass(frozen=True, kw_only=True)
class DeviceRig(Generic[DeviceT]):
    """What the rigs of the three device ports have in common.

    Attributes:
        clock: The clock whose time the adapter writes on its samples.
        advance: Lets the world and time go on by a number of control ticks, in every state of the adapter.
        is_open: Whether the adapter holds a connection or another resource now.
        provoke_fault: Makes the active device fail, and returns when the adapter has latched it.
        disconnect: Cuts the cable, in whatever state the adapter is.
        reconnect: Plugs in again what ``disconnect`` cut.
        dispose: Releases what the rig itself holds, after the adapter was closed.
        call_budget_ns: Longest that a reading or a command may keep the loop waiting.
        runs_by_itself: The world goes on between two calls, as real hardware does.
        settle_ticks: Ticks after which a small move is done, or a reading follows what was changed.
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
        """Every adapter that must be closed after the clause."""
        return (self.device,)

    @property
    def patience_ns(self) -> int:
        """How long the adapter may take to notice that the device is gone."""
        return 0

    def pass_time(self, duration_ns: int) -> None:
        """Let more than ``duration_ns`` go by, one tick at a time.

        Raises:
            ContractViolation: The rig's clock stands still.
        """
        start_ns = self.clock.now_ns()
        while (before_ns := self.clock.now_ns()) <= start_ns + duration_ns:
            self.advance(1)
            require("rig", self.clock.now_ns() > before_ns, "a clock that stands still", "advance() to pass time")


@dataclass(frozen=True, kw_only=True)
class SensorRig(DeviceRig[DeviceT]):
    """What the rigs of the two sensor ports have in common.

    Attributes:
        max_age_ns: Greatest age of a sample that may still be called ``VALID``.
        go_silent: The device stops delivering, without any error.
    """

    max_age_ns: int
    go_silent: Callable[[], None] | None = None

    @property
    @override
    def patience_ns(self) -> int:
        return self.max_age_ns


@dataclass(frozen=True, kw_only=True)
class ForceSensorRig(SensorRig[ForceSensor]):
    """A force sensor on the test bench.

    Attributes:
        push_N: Makes the world exert this force (fx, fy, fz) on the tool, in the sensor frame, until the next call;
            (0, 0, -10) is a surface that presses against the tool axis. Must work before ``configure`` too.
        load_N: Force that is safe and well within range.
        overload_N: Force that may be beyond its range and harms nothing here.
        tolerance_N: Greatest error and noise of a settled reading.
        kind: What the adapter declares to have taken out of the wrench.
        twist_Nm: Makes the world exert this torque on the tool besides, as ``push_N`` does a force.
        load_Nm: Torque that is safe and well within range.
        overload_Nm: Torque that may be beyond its range and harms nothing here.
        tolerance_Nm: Greatest error and noise of a settled reading.
        frame: Frame of the components that the adapter declares.
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
    """What the rigs of the two ports of an arm have in common.

    Attributes:
        step_rad: A move within one tick that every joint is allowed, in both directions.
        tolerance_rad: Greatest distance of an arm at rest from its command, or of an encoder from the joint; less than
            half of ``step_rad``.
    """

    step_rad: float = 1e-3
    tolerance_rad: float = 1e-6


@dataclass(frozen=True, kw_only=True)
class JointEncoderRig(SensorRig[JointEncoder], MovingRig[JointEncoder]):
    """A joint encoder on the test bench.

    Attributes:
        expected_rad: Where the joints really stand, (n,), if that is known.
        arm: The arm whose joints these are, freshly constructed; the same object as ``device`` if one adapter serves
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
        home_rad: Where the arm stands at first, (n,), within the limits. A home close to a limit of one joint makes the
            clause on position limits quick.
        lower_rad: Lower position limits, (n,).
        upper_rad: Upper position limits, (n,).
        fast_step_rad: A move within one tick that is too fast; one joint has room for it at home.
        position_rad: Where the joints really stand, (n,).
        turn_by_hand: Brings the joints of the arm, which is not active, to these angles from outside.
        stop_budget_ns: Longest that ``stop`` may take.
        limit_ticks: Ticks that the arm may be behind on its way to the nearest position limit.
    """

    home_rad: JointVector
    lower_rad: JointVector
    upper_rad: JointVector
    fast_step_rad: float
    position_rad: Callable[[], JointVector] | None = None
    turn_by_hand: Callable[[JointVector], None] | None = None
    stop_budget_ns: int = 100_000_000
    limit_ticks: int = 2000


def knob(value: T | None, name: str) -> T:
    """Return an optional knob of the rig.

    Raises:
        ClauseNotApplicable: The rig has no such knob.
    """
    if value is None:
        raise ClauseNotApplicable(f"this rig has no {name}")
    return value


def require(clause: str, holds: bool, observed: str, wanted: str) -> None:
    """Fail the clause unless ``holds``."""
    if not holds:
        raise ContractViolation(clause, observed, wanted)


def require_raises(clause: str, kind: type[Exception], action: Callable[[], object], wanted: str) -> None:
    """Fail the clause unless ``action`` raises this kind of error; errors of other kinds pass."""
    with suppress(kind):
        raise ContractViolation(clause, f"no error, but {action()!r}", wanted)


def ramp(begin_rad: JointVector, end_rad: JointVector, step_rad: float) -> Iterator[JointVector]:
    """The way from one pose to another in steps of at most ``step_rad`` a joint, all joints arriving together."""
    far = max((abs(e - b) for b, e in zip(begin_rad, end_rad, strict=True)), default=0.0)
    # A way of one step is not two, whatever its floats say.
    steps = ceil(far / step_rad - 1e-6)
    for k in range(1, steps):
        yield tuple(b + k / steps * (e - b) for b, e in zip(begin_rad, end_rad, strict=True))
    if steps:
        yield end_rad
