"""The adapter of the CiA 402 arm keeps the contracts of encoder and arm, against emulated drives in virtual time."""

import pytest

from palpate.adapters.contracts import ArmCommandContract, ArmCommandRig, JointEncoderContract, JointEncoderRig
from palpate.adapters.hardware.plugins import RigContext, arm_maker
from palpate.core.errors import ConfigurationError
from palpate.core.motion.arm import arm_named
from palpate.simulation.emulators.cia402.node import CanopenDrive
from palpate.simulation.emulators.motors.plant import DirectGears, JointPlant
from tests.contracts.bus_bench import DIVIDER, LONG_NS, BusBench
from tests.support.arm_thread import arm_in_thread
from tests.support.arms import driver_arm
from tests.virtual_lines import Cable
from tests.virtual_time import VirtualTime

HOME = (0.1, -0.2, 0.3)
LOWER, UPPER = (-0.1, -0.5, 0.0), (0.3, 0.1, 0.4)
SCALE = (30_000.0, -20_000.0, 10_000.0)


class Following(JointPlant):
    """Motors whose joints stand at their set-points at once."""

    def set_motor_counts(self, axis, counts):
        super().set_motor_counts(axis, counts)
        self.measured_rad(self.targets_rad())

    def turn(self, position_rad):
        """By hand: where nothing holds the joints, they are where they were brought."""
        for axis, (q, k) in enumerate(zip(position_rad, SCALE, strict=True)):
            self.set_motor_counts(axis, q * k)


class Bench(BusBench):
    def __init__(self, timeout_ns=LONG_NS):
        super().__init__()
        self.motors = Following(HOME, DirectGears(SCALE))
        self.drives = [CanopenDrive(axis + 1, self.motors, axis) for axis in range(3)]
        self.cable = Cable(self.clock, self.desk.can("can0", *self.drives), 0.3)
        self.clock.sleep(0.05)  # the drives boot
        context = RigContext(self.clock, arm_named("zebra-zero"), LOWER, UPPER, (1.0,) * 3)
        table = {
            "interface": "virtual", "channel": "can0", "nodes": [1, 2, 3], "counts_per_rad": list(SCALE),
            "divider": DIVIDER, "max_age_ms": 200.0,
        }  # fmt: skip
        self.arm = arm_in_thread(driver_arm("cia402", table, context), self.clock, timeout_ns)

    def fail(self):
        self.drives[0].fail(0x4210)
        self.advance(2)


class TestCia402Encoder(JointEncoderContract):
    # It is the arm, whose lives are below.
    test_life_follows_the_table = None

    def make(self):
        bench = Bench()
        return JointEncoderRig(max_age_ns=250_000_000, joints=3, expected_rad=HOME, arm=bench.arm, **bench.knobs())


class TestCia402Arm(ArmCommandContract):
    def make(self):
        bench = Bench()
        return ArmCommandRig(
            home_rad=HOME,
            lower_rad=LOWER,
            upper_rad=UPPER,
            step_rad=4e-3,
            fast_step_rad=0.1,
            position_rad=bench.motors.targets_rad,
            turn_by_hand=bench.motors.turn,
            settle_ticks=10,
            limit_ticks=100,
            **bench.knobs(),
        )


@pytest.mark.parametrize(
    ("settings", "field"),
    [
        ({}, "arm.counts_per_rad"),
        ({"nodes": [1, 2]}, "arm.nodes"),
        ({"counts_per_rad": [1e4] * 3, "timeout_scale": 0.0}, "arm.timeout_scale"),
    ],
)
def test_settings_that_cannot_work_are_refused(settings, field):
    context = RigContext(VirtualTime(), arm_named("zebra-zero"), LOWER, UPPER, (1.0,) * 3)
    with pytest.raises(ConfigurationError) as message:
        arm_maker("cia402")({"nodes": [1, 2, 3], **settings}, context)
    assert message.value.field == field
