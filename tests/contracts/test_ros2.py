"""The adapters behind ROS 2 keep the contracts of their ports, against an emulated robot in virtual time."""

from dataclasses import replace
from pathlib import Path

import pytest

from palpate.adapters import contracts
from palpate.adapters.config import RigFile, overlay
from palpate.adapters.hardware.plugins import RigContext
from palpate.adapters.hardware.ros2 import Ros2ArmTable, Ros2ForceSensor, Ros2WrenchTable, make_ros2_arm
from palpate.core.errors import ConfigurationError, DeviceError
from palpate.drivers.ros2 import WRENCH
from tests.contracts.bus_bench import LONG_NS, loads
from tests.support.arm_thread import arm_in_thread
from tests.virtual_ros2 import HOME, NAMES, VirtualDomain

LOWER, UPPER = tuple(q - 0.3 for q in HOME), tuple(q + 0.05 for q in HOME)
MAX_AGE_NS = 50_000_000
TABLE = Ros2ArmTable(joints=NAMES, start_timeout_s=0.5)
VELOCITIES = replace(TABLE, mode="velocities", stops_without_commands=True)


class Bench(VirtualDomain):
    """An adapter, and the robot that it talks to."""

    reader = None

    def arm(self, table=TABLE):
        context = replace(RigContext.of("ur5", self.clock), lower_rad=LOWER, upper_rad=UPPER,
                          velocity_limit_rad_s=(1.0,) * 6)  # fmt: skip
        return arm_in_thread(make_ros2_arm(table, context, self.link), self.clock, LONG_NS)

    def sensor(self, **settings):
        table = Ros2WrenchTable(**{"start_timeout_s": 0.5} | settings)
        self.reader = Ros2ForceSensor(lambda: self.link(table.topic, WRENCH, ""), self.clock, table)
        return self.reader

    def fail(self):
        self.publishers = 2
        self.ticks(3)
        if self.reader is not None:
            with pytest.raises(DeviceError, match="2 publishers"):
                self.reader.read()
        self.publishers = 1

    def fall_silent(self):
        self.network = lambda message: None

    def knobs(self):
        # A cut cable looks like silence, so there is no member for it.
        return {
            "clock": self.clock, "advance": self.ticks, "provoke_fault": self.fail, "runs_by_itself": True,
            "is_open": lambda: self.is_open,
        }  # fmt: skip


class TestRos2Encoder(contracts.JointEncoderContract):
    # It is the arm, whose lives are below.
    test_life_follows_the_table = None

    def make(self):
        bench = Bench()
        arm = bench.arm()
        return contracts.JointEncoderRig(
            device=arm, max_age_ns=MAX_AGE_NS + 20_000_000, joints=6, expected_rad=HOME, tolerance_rad=1e-9, arm=arm,
            go_silent=bench.fall_silent, **bench.knobs(),
        )  # fmt: skip


class TestRos2Arm(contracts.ArmCommandContract):
    table = TABLE
    tolerance_rad = 1e-9

    def make(self):
        bench = Bench(velocities=self.table.mode == "velocities")
        return contracts.ArmCommandRig(
            device=bench.arm(self.table), home_rad=HOME, lower_rad=LOWER, upper_rad=UPPER, step_rad=4e-3,
            fast_step_rad=0.03, position_rad=bench.robot.targets_rad, tolerance_rad=self.tolerance_rad,
            settle_ticks=60, limit_ticks=100, **bench.knobs(),
        )  # fmt: skip


class TestRos2VelocityArm(TestRos2Arm):
    # Its link and its states are those of positions.
    test_life_follows_the_table = None
    table = VELOCITIES
    tolerance_rad = 5e-4


class TestRos2Wrench(contracts.ForceSensorContract):
    def make(self):
        bench = Bench()
        return contracts.ForceSensorRig(
            device=bench.sensor(), max_age_ns=MAX_AGE_NS + 10_000_000, **loads(bench.load), go_silent=bench.fall_silent,
            **bench.knobs(),
        )  # fmt: skip


def test_sign_turns_a_wrench_that_the_tool_exerts():
    bench = Bench()
    with bench.sensor(sign=-1) as sensor:
        assert sensor.read().force_N == (0.0, 0.0, 5.0)


@pytest.mark.parametrize(
    ("table", "problem"),
    [
        (replace(VELOCITIES, stops_without_commands=False), "velocities only with stops_without_commands = true"),
        (replace(TABLE, joints=NAMES[:5]), "6 names, one per joint of ur5"),
        (replace(TABLE, joints=(*NAMES[:5], NAMES[0])), "6 names, one per joint of ur5"),
    ],
)
def test_table_that_cannot_work_is_refused_before_anything_opens(table, problem):
    with pytest.raises(ConfigurationError, match=problem):
        Bench().arm(table)


@pytest.mark.parametrize(
    "path", sorted((Path(__file__).parents[2] / "examples" / "rigs").glob("*ros2.toml")), ids=lambda path: path.stem
)
def test_rig_files_of_the_examples_have_settings_that_exist(path):
    file = RigFile.load(path)
    overlay(Ros2ArmTable(), file.arm.settings)
    overlay(Ros2WrenchTable(), file.force_sensor.settings)
    assert file.facts.noise_N is None, "a run is refused until the noise is measured"


def test_joints_without_names_have_those_of_the_model():
    bench = Bench()
    with pytest.raises(DeviceError, match="has no joint shoulder_pan_joint, shoulder_lift_joint"):
        bench.arm(replace(TABLE, joints=())).configure()
