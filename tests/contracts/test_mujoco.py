"""The ports over the simulated work cell keep the contracts of the four ports."""

from dataclasses import dataclass, replace
from functools import cache, partial

import numpy as np

from palpate.adapters.config.run import RunConfig
from palpate.adapters.contracts import (
    ArmCommandContract,
    ArmCommandRig,
    ClockContract,
    ClockRig,
    ForceSensorContract,
    ForceSensorRig,
    JointEncoderContract,
    JointEncoderRig,
)
from palpate.adapters.mujoco.ports import MujocoArm, MujocoClock, MujocoForceSensor, MujocoJointEncoder
from palpate.core.motion import Kinematics, arm_named
from palpate.core.ports import CONTROL_RATE_HZ, JointVector
from palpate.core.trial import find_ready_pose, goal_in_base
from palpate.simulation.work_cell.cell import WorkCell
from tests.support.tool import TOOL

TICK_NS = 10**9 // CONTROL_RATE_HZ
# Loud enough to tell two samples apart, far below the loads; a bias, so that a hidden tare would show.
NOISE_N = 0.01
SETTLE_TICKS = 100  # the servos' integral action takes some tenths of a second
# Limits close to home make the clause on position limits quick; joint limits are the adapter's own to apply.
ROOM_RAD = 0.15


@cache
def the_cell():
    """One work cell for all rigs, because compiling its model costs more than a clause."""
    config = RunConfig()
    sensor = replace(config.cell.sensor, force_noise_N=NOISE_N, torque_noise_Nm=NOISE_N / 10)
    return WorkCell(
        Kinematics(arm_named(config.arm), TOOL),
        replace(config.cell, sensor=sensor),
        goal_in_base=goal_in_base(config.task.goal),
        ready_rad=find_ready_pose(config.arm, config.tool.geometry, config.task).q_rad,
        rate_Hz=CONTROL_RATE_HZ,
    )


@dataclass(frozen=True)
class Bench:
    """The work cell at its start, with what a test needs to act on it."""

    cell: WorkCell
    clock: MujocoClock
    home_rad: JointVector

    @classmethod
    def fresh(cls):
        cell = the_cell()
        cell.reset(0, 0)
        return cls(cell, MujocoClock(cell), cell.joint_angles())

    def advance(self, ticks):
        for _ in range(ticks):
            self.cell.advance()

    def push_N(self, fx, fy, fz):
        """A force on the peg, given in the sensor frame."""
        rotation = self.cell.data.body("sensor").xmat.reshape(3, 3)
        self.cell.data.body("peg").xfrc_applied[:3] = rotation @ np.array([fx, fy, fz])

    @property
    def lower_rad(self):
        return tuple(q - ROOM_RAD for q in self.home_rad)

    @property
    def upper_rad(self):
        return tuple(q + ROOM_RAD for q in self.home_rad)

    @property
    def speed_rad_s(self):
        kinematics = Kinematics(arm_named("zebra-zero"), TOOL)
        return tuple(kinematics.velocity_limit_rad_s.tolist())

    def arm(self):
        return MujocoArm(self.cell, self.lower_rad, self.upper_rad, self.speed_rad_s)


def fault_of(device):
    """The simulation itself never fails; its adapters must behave all the same once something did."""
    return partial(device._latch, "fault on demand")


class TestMujocoClock(ClockContract):
    def make(self):
        # Time goes on by whole ticks: a sleep may return up to one tick late.
        return ClockRig(clock=Bench.fresh().clock, tolerance_ns=TICK_NS + 1, step_ns=50_000_000, deadlines=50)


class TestMujocoForceSensor(ForceSensorContract):
    def make(self):
        bench = Bench.fresh()
        sensor = MujocoForceSensor(bench.cell)
        return ForceSensorRig(
            device=sensor,
            clock=bench.clock,
            advance=bench.advance,
            max_age_ns=TICK_NS // bench.cell.config.substeps + 1,
            push_N=bench.push_N,
            load_N=5.0,
            tolerance_N=10 * NOISE_N,
            settle_ticks=SETTLE_TICKS,
            provoke_fault=fault_of(sensor),
        )


class TestMujocoJointEncoder(JointEncoderContract):
    def make(self):
        bench = Bench.fresh()
        encoder = MujocoJointEncoder(bench.cell)
        half_a_count_rad = max(arm_named("zebra-zero").encoder_step_rad) / 2
        return JointEncoderRig(
            device=encoder,
            clock=bench.clock,
            advance=bench.advance,
            max_age_ns=0,
            joints=len(bench.home_rad),
            expected_rad=bench.home_rad,
            tolerance_rad=half_a_count_rad + 1e-6,
            arm=bench.arm(),
            provoke_fault=fault_of(encoder),
        )


class TestMujocoArm(ArmCommandContract):
    def make(self):
        bench = Bench.fresh()
        arm = bench.arm()
        return ArmCommandRig(
            device=arm,
            clock=bench.clock,
            advance=bench.advance,
            home_rad=bench.home_rad,
            lower_rad=bench.lower_rad,
            upper_rad=bench.upper_rad,
            fast_step_rad=2.0 * max(bench.speed_rad_s) / CONTROL_RATE_HZ,
            position_rad=bench.cell.joint_angles,
            tolerance_rad=2e-5,
            settle_ticks=SETTLE_TICKS,
            limit_ticks=200,
            provoke_fault=fault_of(arm),
        )


def test_time_is_exact_however_long_it_runs():
    bench = Bench.fresh()
    first = bench.cell.ticks
    bench.clock.sleep_until(bench.clock.now_ns() + 10**9)
    assert bench.cell.ticks in (first + CONTROL_RATE_HZ, first + CONTROL_RATE_HZ + 1)
    assert bench.clock.now_ns() == bench.cell.ticks * 10**9 // CONTROL_RATE_HZ


def test_noise_is_drawn_anew_for_each_tick():
    bench = Bench.fresh()
    with MujocoForceSensor(bench.cell) as sensor:
        first = sensor.read()
        bench.advance(1)
        assert sensor.read().torque_Nm != first.torque_Nm
