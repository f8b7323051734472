"""Contract checks for all three ports over TCP. Run them with ``palpate rig check third_party_rig.checks:ArmChecks``.

The checks use fake devices and a clock that only ``advance`` moves. For your devices, use ``MonotonicClock``, sleep in
``advance``, set ``runs_by_itself=True``, and omit arguments that do not apply. Checks that need them are then skipped.
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
    """The arm's adapter with a fake device."""

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
        """Make the device report a fault, and wait until the adapter has latched it."""
        self.device.fail("over-current in joint 2")
        with suppress(DeviceError):
            self.arm.read()


class ArmChecks(ArmCommandContract):
    """Checks for the ArmCommand contract."""

    def make(self) -> ArmCommandRig:
        """Create a new rig."""
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
    """Checks for the JointEncoder contract."""

    def make(self) -> JointEncoderRig:
        """Create a new rig."""
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
    """Checks for the ForceSensor contract."""

    def make(self) -> ForceSensorRig:
        """Create a new rig. The adapter does not remove the sensor's offset or the weight of its tool."""
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
