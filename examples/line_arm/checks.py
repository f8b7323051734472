"""The contracts of both ports, tried on the adapter: ``palpate check-adapter checks:ArmChecks`` and ``EncoderChecks``.

The rig is an arm in a few lines, so that the checks run without hardware. Against your real arm, return a rig with
your own clock, ``runs_by_itself=True``, and the knobs that you have.
"""

from __future__ import annotations

from line_arm import LineArm

from palpate.core.ports import CONTROL_RATE_HZ, CommandLimiter
from palpate.core.ports.contracts import (
    TICK_NS,
    ArmCommandContract,
    ArmCommandRig,
    FakeClock,
    JointEncoderContract,
    JointEncoderRig,
)

HOME_RAD = (0.1, -0.2, 0.3)
LOWER_RAD, UPPER_RAD = (-1.0,) * 3, (1.0, 1.0, 0.4)
SPEED_RAD_S = (2.0,) * 3


class PretendArm:
    """The other end of the line: stands at its set-point as soon as time has gone on."""

    def __init__(self, clock: FakeClock) -> None:
        self._clock, self._since_ns = clock, clock.now_ns()
        self._here = self._target = HOME_RAD
        self._answer = b""
        self.connected, self.open = True, False

    def opened(self) -> PretendArm:
        if not self.connected:
            raise OSError("no such port")
        self.open = True
        return self

    def joints(self) -> tuple[float, ...]:
        if self._clock.now_ns() > self._since_ns:
            self._here = self._target
        return self._here

    def write(self, data: bytes, /) -> None:
        if not self.connected:
            raise OSError("cable pulled")
        word, *numbers = data.split()
        if word == b"G":
            self.joints()
            self._target, self._since_ns = tuple(map(float, numbers)), self._clock.now_ns()
        elif word == b"S":
            self._target = self.joints()
        self._answer = b"J " + " ".join(map(repr, self.joints())).encode() + b"\n"

    def readline(self) -> bytes:
        return self._answer

    def close(self) -> None:
        self.open = False


def bench() -> tuple[FakeClock, PretendArm, LineArm]:
    """An adapter with its arm."""
    clock = FakeClock()
    pretend = PretendArm(clock)
    limiter = CommandLimiter(LOWER_RAD, UPPER_RAD, SPEED_RAD_S, CONTROL_RATE_HZ)
    return clock, pretend, LineArm(pretend.opened, clock, limiter)


class ArmChecks(ArmCommandContract):
    """The contract of ArmCommand."""

    def make(self) -> ArmCommandRig:
        """A fresh rig."""
        clock, pretend, arm = bench()
        return ArmCommandRig(
            device=arm,
            clock=clock,
            advance=clock.advance,
            home_rad=HOME_RAD,
            lower_rad=LOWER_RAD,
            upper_rad=UPPER_RAD,
            fast_step_rad=0.1,
            position_rad=pretend.joints,
            is_open=lambda: pretend.open,
            disconnect=lambda: setattr(pretend, "connected", False),
            provoke_fault=lambda: _pull_cable(pretend, arm),
        )


class EncoderChecks(JointEncoderContract):
    """The contract of JointEncoder."""

    def make(self) -> JointEncoderRig:
        """A fresh rig."""
        clock, pretend, arm = bench()
        return JointEncoderRig(
            device=arm,
            clock=clock,
            advance=clock.advance,
            max_age_ns=TICK_NS,
            joints=len(HOME_RAD),
            expected_rad=HOME_RAD,
            arm=arm,
            is_open=lambda: pretend.open,
            disconnect=lambda: setattr(pretend, "connected", False),
            provoke_fault=lambda: _pull_cable(pretend, arm),
        )


def _pull_cable(pretend: PretendArm, arm: LineArm) -> None:
    """Long enough for the adapter to notice."""
    pretend.connected = False
    arm.stop()
    pretend.connected = True
