"""The adapters of a Universal Robots arm keep the contracts of their ports, against an emulated controller."""

import pytest

from palpate.adapters import contracts
from palpate.adapters.hardware.plugins import RigContext
from palpate.adapters.hardware.ur import UrTable, UrToolForceSensor, UrToolTable, make_ur_rtde
from palpate.core.errors import DeviceError
from palpate.core.motion.arm import arm_named
from tests.contracts.bus_bench import LONG_NS, loads
from tests.support.arm_thread import arm_in_thread
from tests.virtual_ur import HOME, VirtualUr

LOWER, UPPER = tuple(q - 0.3 for q in HOME), tuple(q + 0.05 for q in HOME)
MAX_AGE_NS = 50_000_000


class Bench(VirtualUr):
    """An adapter, and the controller that it talks to."""

    reader = None

    def arm(self, timeout_ns=LONG_NS):
        context = RigContext(self.clock, arm_named("ur5"), LOWER, UPPER, (1.0,) * 6, accept_kinematics=True)
        return arm_in_thread(make_ur_rtde(UrTable(), context, lambda: self), self.clock, timeout_ns)

    def sensor(self):
        self.reader = UrToolForceSensor(lambda: self, self.clock, UrToolTable(start_timeout_s=1.0))
        return self.reader

    def fail(self):
        self.controller.emergency_stop()
        self.ticks(3)
        self.controller.release()
        self.controller.robot_mode = type(self.controller.robot_mode).RUNNING

    def cut(self):
        self.is_plugged = False
        self.ticks(1)
        with pytest.raises(DeviceError, match="broken"):
            self.reader.read()
        self.is_plugged = True

    def set_plugged(self, is_plugged):
        self.is_plugged = is_plugged

    def fall_silent(self):
        self.is_silent = True

    def knobs(self):
        return {
            "clock": self.clock, "advance": self.ticks, "runs_by_itself": True, "is_open": lambda: self.is_open,
            "disconnect": lambda: self.set_plugged(False), "reconnect": lambda: self.set_plugged(True),
        }  # fmt: skip


class TestUrEncoder(contracts.JointEncoderContract):
    # It is the arm, whose lives are below.
    test_life_follows_the_table = None

    def make(self):
        bench = Bench()
        arm = bench.arm()
        return contracts.JointEncoderRig(
            device=arm, max_age_ns=MAX_AGE_NS + 20_000_000, joints=6, expected_rad=HOME, tolerance_rad=2e-4, arm=arm,
            provoke_fault=bench.fail, go_silent=bench.fall_silent, **bench.knobs(),
        )  # fmt: skip


class TestUrArm(contracts.ArmCommandContract):
    def make(self):
        bench = Bench()
        return contracts.ArmCommandRig(
            device=bench.arm(), home_rad=HOME, lower_rad=LOWER, upper_rad=UPPER, step_rad=4e-3, fast_step_rad=0.03,
            position_rad=bench.controller.targets_rad, tolerance_rad=2e-4, settle_ticks=60, limit_ticks=100,
            provoke_fault=bench.fail, **bench.knobs(),
        )  # fmt: skip


class TestUrToolForce(contracts.ForceSensorContract):
    def make(self):
        bench = Bench()
        return contracts.ForceSensorRig(
            device=bench.sensor(), max_age_ns=MAX_AGE_NS + 10_000_000, **loads(bench.load), go_silent=bench.fall_silent,
            provoke_fault=bench.cut, **bench.knobs(),
        )  # fmt: skip


def test_arm_of_seven_joints_is_refused():
    context = RigContext.of("panda", VirtualUr().clock)
    with pytest.raises(Exception, match="an arm of 6 joints"):
        make_ur_rtde(UrTable(), context, VirtualUr)
