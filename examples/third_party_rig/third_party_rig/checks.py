"""The contracts of all three ports, tried over TCP: ``palpate rig check third_party_rig.checks:ArmChecks``.

The devices are the fake ones, on a clock that only ``advance`` puts on. Against yours, take ``MonotonicClock``, sleep
in ``advance``, set ``runs_by_itself=True``, and leave away the knobs that you lack: their clauses do not apply then.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress

from palpate.adapters.contracts import (
    ArmCommandContract,
    ArmCommandRig,
    FakeClock,
    ForceSensorContract,
    ForceSensorRig,
    JointEncoderContract,
    JointEncoderRig,
)
from palpate.core.errors import DeviceError
from palpate.core.ports import CONTROL_RATE_HZ, CommandLimiter
from third_party_rig.arm import BenchArm
from third_party_rig.device import MAX_AGE_NS
from third_party_rig.fake import FakeDevice, FakeServos
from third_party_rig.force import BenchForceSensor

HOME_RAD = (0.1, -0.2, 0.3)
LOWER_RAD, UPPER_RAD = (-1.0,) * 3, (1.0, 1.0, 0.4)
SPEED_RAD_S = (2.0,) * 3


class ArmBench:
    """The adapter of the arm, with its fake device."""

    def __init__(self) -> None:
        self.clock, self.servos = FakeClock(), FakeServos(HOME_RAD)
        self.device = FakeDevice("bench-arm", self.clock, lambda: self.servos.held_rad, self.servos.command)
        limiter = CommandLimiter(LOWER_RAD, UPPER_RAD, SPEED_RAD_S, CONTROL_RATE_HZ)
        self.arm = BenchArm(self.device.address, self.clock, limiter)

    def advance(self, ticks: int) -> None:
        for _ in range(ticks):
            self.device.take_in()
            self.clock.advance()
            self.servos.tick()
            self.device.tick()

    def fault(self) -> None:
        """The device reports a fault, and the adapter has latched it when this returns."""
        self.device.fail("over-current in joint 2")
        with suppress(DeviceError):
            self.arm.read()


class ArmChecks(ArmCommandContract):
    """The contract of ArmCommand."""

    def make(self) -> ArmCommandRig:
        """A fresh rig."""
        bench = ArmBench()
        return ArmCommandRig(
            device=bench.arm,
            clock=bench.clock,
            advance=bench.advance,
            home_rad=HOME_RAD,
            lower_rad=LOWER_RAD,
            upper_rad=UPPER_RAD,
            fast_step_rad=0.1,
            position_rad=lambda: bench.servos.held_rad,
            turn_by_hand=bench.servos.turn_by_hand,
            settle_ticks=1,  # these servos are there at once; yours need as many ticks as a move of step_rad takes
            is_open=lambda: bench.arm.is_open,
            disconnect=bench.device.close,
            reconnect=bench.device.plug_in,
            provoke_fault=bench.fault,
            dispose=bench.device.close,
        )


class EncoderChecks(JointEncoderContract):
    """The contract of JointEncoder."""

    def make(self) -> JointEncoderRig:
        """A fresh rig."""
        bench = ArmBench()
        return JointEncoderRig(
            device=bench.arm,
            clock=bench.clock,
            advance=bench.advance,
            max_age_ns=MAX_AGE_NS,
            joints=len(HOME_RAD),
            expected_rad=HOME_RAD,
            arm=bench.arm,
            go_silent=lambda: setattr(bench.device, "silent", True),
            is_open=lambda: bench.arm.is_open,
            disconnect=bench.device.close,
            reconnect=bench.device.plug_in,
            provoke_fault=bench.fault,
            dispose=bench.device.close,
        )


class ForceChecks(ForceSensorContract):
    """The contract of ForceSensor."""

    def make(self) -> ForceSensorRig:
        """A fresh rig; its sensor has an offset and carries a tool, which the adapter leaves in."""
        clock, force, torque = FakeClock(), [0.0] * 3, [0.0] * 3
        device = FakeDevice("bench-force", clock, lambda: (1.0 + force[0], force[1], -4.0 + force[2], *torque))
        sensor = BenchForceSensor(device.address, clock)

        def advance(ticks: int) -> None:
            for _ in range(ticks):
                clock.advance()
                device.tick()

        def fault() -> None:
            device.fail("a broken gauge")
            with suppress(DeviceError):
                sensor.read()

        return ForceSensorRig(
            device=sensor,
            clock=clock,
            advance=advance,
            max_age_ns=MAX_AGE_NS,
            push_N=_setting(force),
            twist_Nm=_setting(torque),
            overload_N=500.0,
            overload_Nm=50.0,
            go_silent=lambda: setattr(device, "silent", True),
            is_open=lambda: sensor.is_open,
            disconnect=device.close,
            reconnect=device.plug_in,
            provoke_fault=fault,
            dispose=device.close,
        )


def _setting(vector: list[float]) -> Callable[[float, float, float], None]:
    def put(x: float, y: float, z: float) -> None:
        vector[:] = x, y, z

    return put
