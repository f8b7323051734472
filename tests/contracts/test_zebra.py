"""The Zebra Zero adapter keeps the contracts of encoder and arm, against emulated modules in virtual time."""

from typing import Any

from palpate.adapters.hardware.arm_on_bus import BusArm
from palpate.adapters.hardware.plugins import RigContext
from palpate.adapters.hardware.zebra_zero import make_zebra_nmc
from palpate.core.motion.arm import arm_named
from palpate.core.ports.contracts import ArmCommandContract, ArmCommandRig, JointEncoderContract, JointEncoderRig
from palpate.simulation.emulators.motors.plant import HOME_RAD
from palpate.simulation.emulators.nmc.bus import NmcChain
from tests.ideal_motors import IdealPlant
from tests.virtual_lines import Cable, VirtualDesk

BAUD = 230_400
DIVIDER = 2
LOWER = (-3.14, -1.07, -1.70, -3.14, -3.14, -3.14)
UPPER = (3.14, 1.70, 1.07, 3.14, 3.14, 3.14)
SETTLE_TICKS = 10


class Bench:
    """An adapter and the modules that it talks to."""

    def __init__(self, **settings: Any) -> None:
        self.desk = VirtualDesk()
        self.clock = self.desk.clock
        self.plant = IdealPlant()
        self.bus = NmcChain(self.plant)
        # A line on which nobody answers is told to stop for 0.3 s.
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
        arm = make_zebra_nmc(table, context).arm
        assert isinstance(arm, BusArm)
        self.arm = arm

    def advance(self, ticks: int) -> None:
        # The arm's own ticks, one bus cycle each.
        self.clock.sleep(ticks * DIVIDER / 140)

    def overload(self) -> None:
        """The first motor draws too much current; returns when the adapter has noticed."""
        self.bus.modules[0].servo.overcurrent = True
        self.advance(2)


class TestZebraEncoder(JointEncoderContract):
    def make(self) -> JointEncoderRig:
        bench = Bench()
        return JointEncoderRig(
            device=bench.arm,
            clock=bench.clock,
            advance=bench.advance,
            max_age_ns=150_000_000,
            joints=6,
            expected_rad=HOME_RAD,
            tolerance_rad=2e-4,
            arm=bench.arm,
            provoke_fault=bench.overload,
            fail_at_rest=bench.overload,
            disconnect=bench.cable.cut,
            reconnect=bench.cable.join,
            dispose=bench.desk.close,
            runs_by_itself=True,
            long_ticks=300,
        )


class TestZebraArm(ArmCommandContract):
    def make(self) -> ArmCommandRig:
        bench = Bench()
        return ArmCommandRig(
            device=bench.arm,
            clock=bench.clock,
            advance=bench.advance,
            home_rad=HOME_RAD,
            lower_rad=LOWER,
            upper_rad=UPPER,
            fast_step_rad=0.1,
            position_rad=bench.plant.joints_rad,
            tolerance_rad=2e-4,
            settle_ticks=SETTLE_TICKS,
            limit_ticks=300,
            provoke_fault=bench.overload,
            fail_at_rest=bench.overload,
            disconnect=bench.cable.cut,
            reconnect=bench.cable.join,
            dispose=bench.desk.close,
            runs_by_itself=True,
            long_ticks=300,
            rest_ticks=200,
        )
