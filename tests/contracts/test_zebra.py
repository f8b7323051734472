"""The Zebra Zero adapter keeps the contracts of encoder and arm, against emulated modules in virtual time."""

from palpate.adapters.contracts import ArmCommandContract, ArmCommandRig, JointEncoderContract, JointEncoderRig
from palpate.adapters.hardware.plugins import RigContext
from palpate.core.motion.arm import arm_named
from palpate.simulation.emulators.motors.plant import HOME_RAD
from palpate.simulation.emulators.nmc.bus import NmcChain
from tests.contracts.bus_bench import DIVIDER, LONG_NS, BusBench
from tests.support.arm_thread import arm_in_thread
from tests.support.arms import driver_arm
from tests.support.ideal_motors import IdealPlant
from tests.virtual_lines import Cable

BAUD = 230_400
LOWER = (-3.14, -1.07, -1.70, -3.14, -3.14, -3.14)
UPPER = (3.14, 1.70, 1.07, 3.14, 3.14, 3.14)
SETTLE_TICKS = 10


class Bench(BusBench):
    def __init__(self, timeout_ns=LONG_NS, **settings):
        super().__init__()
        self.plant = IdealPlant()
        self.bus = NmcChain(self.plant)
        # The stop is repeated for 0.3 s on a line without answers.
        self.cable = Cable(self.clock, self.desk.serial("arm", self.bus), 0.6)
        context = RigContext(self.clock, arm_named("zebra-zero"), LOWER, UPPER, (1.0,) * 6)
        table = {
            "port": "arm",
            "baud": BAUD,
            "adapter_latency_ms": 0.0,
            "divider": DIVIDER,
            "at_home": True,
            "reset_wait_ms": 10.0,
            **settings,
        }
        self.arm = arm_in_thread(driver_arm("zebra-nmc", table, context), self.clock, timeout_ns)

    def fail(self):
        """The first motor draws too much current."""
        self.bus.modules[0].servo.overcurrent = True
        self.advance(3)


class TestZebraEncoder(JointEncoderContract):
    # It is the arm, whose lives are below.
    test_life_follows_the_table = None

    def make(self):
        bench = Bench()
        return JointEncoderRig(max_age_ns=150_000_000, joints=6, expected_rad=HOME_RAD, arm=bench.arm, **bench.knobs())


class TestZebraArm(ArmCommandContract):
    def make(self):
        bench = Bench()
        return ArmCommandRig(
            home_rad=HOME_RAD,
            lower_rad=LOWER,
            upper_rad=UPPER,
            fast_step_rad=0.1,
            position_rad=bench.plant.joints_rad,
            settle_ticks=SETTLE_TICKS,
            limit_ticks=300,
            **bench.knobs(),
        )
