"""The fakes keep the contracts of the four ports."""

from dataclasses import replace
from typing import Any, ClassVar

from palpate.adapters.contracts import (
    ArmCommandContract,
    ArmCommandRig,
    ClockContract,
    ClockRig,
    FakeClock,
    ForceSensorContract,
    ForceSensorRig,
    JointEncoderContract,
    JointEncoderRig,
)
from palpate.adapters.hardware.operator_stop import GuardedArm, OperatorStop
from tests.fake_devices import MAX_AGE_NS, FakeArm, FakeForceSensor, FakeJointEncoder

HOME_RAD = (0.1, -0.2, 0.3)
LOWER_RAD = (-1.0, -1.0, -1.0)
UPPER_RAD = (1.0, 1.0, 0.5)


def make_arm(clock, kind=FakeArm):
    return kind(clock, HOME_RAD, lower_rad=LOWER_RAD, upper_rad=UPPER_RAD, max_step_rad=0.02)


class OfKind:
    """What a suite tries: a kind of fake, and a rig in which some knobs may differ or be missing."""

    kind = None
    knobs: ClassVar[dict[str, Any]] = {}

    @classmethod
    def trying(cls, kind=None, **knobs):
        suite = cls()
        suite.kind = kind or cls.kind
        suite.knobs = knobs
        return suite


class TestFakeClock(OfKind, ClockContract):
    kind = FakeClock

    def make(self):
        return ClockRig(**{"clock": self.kind(start_ns=7), "step_ns": 5_000_000, **self.knobs})


class TestFakeForceSensor(OfKind, ForceSensorContract):
    kind = FakeForceSensor

    def make(self):
        clock = FakeClock()
        sensor = self.kind(clock)
        knobs = {
            "advance": clock.advance,
            "push_N": lambda fx, fy, fz: setattr(sensor, "load_N", (fx, fy, fz)),
            "overload_N": 500.0,
            "overload_Nm": 50.0,
            "twist_Nm": lambda tx, ty, tz: setattr(sensor, "load_Nm", (tx, ty, tz)),
            "go_silent": lambda: setattr(sensor, "silent", True),
            "disconnect": lambda: setattr(sensor, "disconnected", True),
            "reconnect": lambda: setattr(sensor, "disconnected", False),
            "provoke_fault": sensor.fail,
            "is_open": lambda: sensor.is_open,
        }
        return ForceSensorRig(device=sensor, clock=clock, max_age_ns=MAX_AGE_NS, **(knobs | self.knobs))


class TestFakeJointEncoder(OfKind, JointEncoderContract):
    kind = FakeJointEncoder

    def make(self):
        clock = FakeClock()
        arm = make_arm(clock)
        encoder = self.kind(clock, arm.position_rad)
        encoder.arm = arm  # for those that look where they must not
        knobs = {
            "expected_rad": HOME_RAD,
            "arm": arm,
            "go_silent": lambda: setattr(encoder, "silent", True),
            "disconnect": lambda: setattr(encoder, "disconnected", True),
            "reconnect": lambda: setattr(encoder, "disconnected", False),
            "provoke_fault": encoder.fail,
            "is_open": lambda: encoder.is_open,
        }
        rig = {"device": encoder, "clock": clock, "advance": clock.advance, "max_age_ns": MAX_AGE_NS}
        return JointEncoderRig(**rig, joints=3, **(knobs | self.knobs))


class TestFakeArm(OfKind, ArmCommandContract):
    kind = FakeArm

    def make(self):
        clock = FakeClock()
        arm = make_arm(clock, self.kind)
        knobs = {
            "position_rad": arm.position_rad,
            "turn_by_hand": arm.turn_by_hand,
            "disconnect": lambda: setattr(arm, "disconnected", True),
            "reconnect": lambda: setattr(arm, "disconnected", False),
            "provoke_fault": arm.fail,
            "is_open": lambda: arm.is_open,
        }
        limits = {"home_rad": HOME_RAD, "lower_rad": LOWER_RAD, "upper_rad": UPPER_RAD, "fast_step_rad": 0.1}
        return ArmCommandRig(device=arm, clock=clock, advance=clock.advance, **limits, **(knobs | self.knobs))


class TestGuardedArm(ArmCommandContract):
    """Under the operator's stop an arm keeps the contract as it does without."""

    def make(self):
        rig = TestFakeArm().make()
        return replace(rig, device=GuardedArm(rig.device, OperatorStop(rig.device)))
