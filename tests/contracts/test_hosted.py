"""A stranger's arm keeps the contracts in the arm's process as it keeps them in the loop's."""

from palpate.adapters.contracts import TICK_NS, ArmCommandContract, ArmCommandRig, JointEncoderContract, JointEncoderRig
from palpate.adapters.hardware.adapter_arm import AdapterArm
from palpate.adapters.hardware.arm_process import PACE_NS
from palpate.adapters.hardware.plugins import ArmAdapter, RigContext
from palpate.core.motion import arm_named
from tests.contracts.bus_bench import LONG_NS
from tests.fake_devices import MAX_AGE_NS, FakeArm, FakeJointEncoder
from tests.support.arm_thread import arm_in_thread
from tests.virtual_time import VirtualTime

LATENCY_NS = 5_000_000
HOME, LOWER, UPPER = (0.1, -0.2, 0.3), (0.05, -0.25, 0.25), (0.25, -0.15, 0.35)


class LatentArm(FakeArm):
    """Stands at a set-point some milliseconds after it got it."""

    def send(self, command):
        applied = super().send(command)
        self._target_since_ns += LATENCY_NS
        return applied


class Bench:
    """Encoders and servos, two objects, behind one line."""

    def __init__(self, timeout_ns=LONG_NS):
        self.clock = VirtualTime()
        self.servos = LatentArm(self.clock, HOME, lower_rad=LOWER, upper_rad=UPPER, max_step_rad=0.02)
        self.encoder = FakeJointEncoder(self.clock, self.servos.position_rad, max_age_ns=MAX_AGE_NS)
        context = RigContext(self.clock, arm_named("zebra-zero"), LOWER, UPPER, (1.0,) * 3)
        self.arm = arm_in_thread(AdapterArm(ArmAdapter(self.encoder, self.servos), context), self.clock, timeout_ns)

    def advance(self, ticks):
        # And for what there is to be noted.
        self.clock.sleep_until(self.clock.now_ns() + ticks * TICK_NS + PACE_NS)

    def knobs(self):
        def fail():
            self.servos.fail()
            self.advance(1)

        def set_cut(is_cut):
            self.servos.disconnected = self.encoder.disconnected = is_cut
            self.advance(1)

        return {
            "device": self.arm,
            "clock": self.clock,
            "advance": self.advance,
            "provoke_fault": fail,
            "disconnect": lambda: set_cut(True),
            "reconnect": lambda: set_cut(False),
            "is_open": lambda: self.servos.is_open and self.encoder.is_open,
            "runs_by_itself": True,
        }


class TestHostedArm(ArmCommandContract):
    def make(self):
        bench = Bench()
        return ArmCommandRig(
            home_rad=HOME,
            lower_rad=LOWER,
            upper_rad=UPPER,
            fast_step_rad=0.1,
            position_rad=bench.servos.position_rad,
            **bench.knobs(),
        )


class TestHostedEncoder(JointEncoderContract):
    def make(self):
        bench = Bench()

        def go_silent():
            bench.encoder.silent = True

        knobs = bench.knobs() | {"provoke_fault": None, "go_silent": go_silent}
        return JointEncoderRig(joints=3, expected_rad=HOME, max_age_ns=MAX_AGE_NS + PACE_NS, arm=bench.arm, **knobs)
