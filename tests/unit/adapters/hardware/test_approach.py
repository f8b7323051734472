"""The way of an arm to its ready pose."""

from contextlib import nullcontext
from dataclasses import replace
from itertools import count, pairwise
from math import dist, tau

import numpy as np
import pinocchio as pin
import pytest

from palpate.adapters.config.run import RunConfig
from palpate.adapters.experiments import baseline, build_perception, build_task, run_scored_trial
from palpate.adapters.hardware.approach import (
    WITHDRAWAL_M_S,
    find_approach,
    move_to_ready,
    require_right_turn,
    withdrawal,
)
from palpate.adapters.mujoco.rig import SimulatedRig
from palpate.core.errors import DeviceError
from palpate.core.motion import InverseKinematics, Kinematics
from palpate.core.ports.decorator import DeviceDecorator
from palpate.core.ports.devices import ArmCommand, ForceSensor, JointEncoder
from palpate.core.ports.rig import SensorFacts
from palpate.core.ports.values import (
    CONTROL_RATE_HZ,
    AppliedCommand,
    CommandReason,
    JointCommand,
    JointVector,
    Validity,
)
from palpate.core.supervision import SampleMonitor
from palpate.core.trial import find_ready_pose, goal_in_base
from tests.support.tool import TOOL
from tests.unit.adapters.samples import ready_pose

CONFIG = RunConfig()
APPROACH = find_approach(CONFIG, ready_pose())


def way(ports, speed_rad_s=0.8, limit_N=CONFIG.task.max_force_N):
    """The way, under the watch of a rig with such a sensor."""
    move_to_ready(APPROACH, ports, speed_rad_s, limit_N, SampleMonitor(CONFIG.supervision, SensorFacts(0.1, 0.004)))


def tip_m(q_rad):
    """The tip in the frame of the goal, z into the hole, (3,)."""
    kinematics = Kinematics(APPROACH.arm, TOOL)
    kinematics.update(q_rad)
    return goal_in_base(CONFIG.task.goal).actInv(kinematics.tip_position_m)


def a_turn_off(sample):
    q = sample.position_rad
    return replace(sample, position_rad=(*q[:4], q[4] + tau, q[5]))


class Altered(DeviceDecorator, ForceSensor, JointEncoder):
    """A sensor whose samples differ from the true ones."""

    def __init__(self, sensor, past):
        super().__init__(sensor)
        self.read = lambda: past(sensor.read())

    def read(self): ...


class SentCommands(DeviceDecorator, ArmCommand):
    """Keeps what was asked."""

    def __init__(self, arm):
        super().__init__(arm)
        self._arm, self.requested = arm, list[JointVector]()

    def send(self, command):
        self.requested.append(command.position_rad)
        return self._arm.send(command)

    def stop(self):
        self._arm.stop()


def test_a_peg_left_in_its_hole_is_drawn_out_before_the_arm_goes_anywhere():
    policy = baseline("torque", CONFIG, tuple)
    with SimulatedRig(CONFIG, ready_pose()) as rig:
        task = build_task(CONFIG, ready_pose(), build_perception(CONFIG), policy)
        assert run_scored_trial(CONFIG, rig, task, 0).success
        deep = rig.ports.joint_encoder.read().position_rad
        assert tip_m(deep)[2] > 9e-3
        path = withdrawal(APPROACH, deep)
        tips = np.array([tip_m(q) for q in path])
        # Straight: no step of the way leaves the tool's axis, nor is it faster than it should be.
        assert np.abs(tips[:, :2] - tip_m(deep)[:2]).max() < 5e-5
        assert np.diff(tips[:, 2]).min() > -1.01 * WITHDRAWAL_M_S / CONTROL_RATE_HZ
        assert tips[-1, 2] == pytest.approx(-CONFIG.task.ready_height_mm * 1e-3, abs=1e-5)

        rig.ports.arm.deactivate()
        rig.ports.arm.activate()
        way(rig.ports)
        there = rig.ports.joint_encoder.read().position_rad
    assert dist(there, APPROACH.poses_rad[-1]) < 5e-3


def test_an_arm_that_is_clear_or_points_elsewhere_is_not_drawn_back():
    above, ready = APPROACH.poses_rad
    assert withdrawal(APPROACH, above) == []
    aside = (*ready[:4], ready[4] + 0.4, ready[5])
    assert withdrawal(APPROACH, aside) == []


@pytest.mark.parametrize(
    ("arm", "joint", "off_rad", "refused"),
    [
        ("zebra-zero", 0, tau, True),
        ("zebra-zero", 5, 3.1, False),
        # Beyond half a turn, and yet a turn less would be outside the elbow's limits.
        ("ur5", 2, -3.2, False),
        ("ur5", 2, tau, True),
    ],
)
def test_an_encoder_that_lost_a_turn_is_refused_before_the_arm_moves(arm, joint, off_rad, refused):
    config = replace(CONFIG, arm=arm)
    approach = find_approach(config, find_ready_pose(arm, config.tool.geometry, config.task))
    read = list(approach.poses_rad[-1])
    read[joint] += off_rad
    with pytest.raises(DeviceError, match=f"joint {joint + 1} reads") if refused else nullcontext():
        require_right_turn(approach, tuple(read))


@pytest.mark.parametrize(
    ("altered", "message"),
    [
        # Joint 5 reads a turn too much.
        (
            lambda ports: {"joint_encoder": Altered(ports.joint_encoder, a_turn_off)},
            r"joint encoder: joint 5 reads 6\.89\d\d rad, .* ready pose, 0\.6101 rad",
        ),
        (
            lambda ports: {"force_sensor": Altered(ports.force_sensor, lambda sample: replace(sample, frame="base"))},
            "raw wrenches in the frame 'base'; the task requires raw wrenches in 'sensor'",
        ),
    ],
    ids=["a lost turn", "another frame"],
)
def test_sample_that_would_mislead_is_refused_before_the_arm_moves(altered, message):
    with SimulatedRig(CONFIG, ready_pose()) as rig:
        rig.prepare(0)
        sent = SentCommands(rig.ports.arm)
        with pytest.raises(DeviceError, match=message):
            way(replace(rig.ports, arm=sent, **altered(rig.ports)))
    assert sent.requested == []


def test_sensor_that_passes_silence_off_as_news_ends_the_way():
    with SimulatedRig(CONFIG, ready_pose()) as rig:
        rig.prepare(0)
        first, reads = rig.ports.force_sensor.read(), count()
        frozen = Altered(rig.ports.force_sensor, lambda _: replace(first, sequence=first.sequence + next(reads)))
        begin_ns = rig.ports.clock.now_ns()
        with pytest.raises(DeviceError, match=r"SAMPLE_STALE: .* on the path to the ready pose"):
            way(replace(rig.ports, force_sensor=frozen), 0.2)
        assert rig.ports.clock.now_ns() - begin_ns < 500_000_000


def test_something_in_the_way_stops_the_arm():
    with SimulatedRig(CONFIG, ready_pose()) as rig:
        rig.prepare(0)
        with pytest.raises(DeviceError, match="N on the path"):
            way(rig.ports, limit_N=0.001)
        reason = rig.ports.arm.send(JointCommand(APPROACH.poses_rad[0])).reason
    assert reason is CommandReason.STOPPED


def test_an_arm_that_was_left_pressing_may_let_go_of_more_than_the_limit():
    limit_N, kinematics = CONFIG.task.max_force_N, Kinematics(APPROACH.arm, TOOL)
    inverse = InverseKinematics(kinematics, 1.0 / CONTROL_RATE_HZ)
    with SimulatedRig(CONFIG, ready_pose()) as rig:
        rig.prepare(0)
        ports = rig.ports
        q = ports.joint_encoder.read().position_rad
        kinematics.update(q)
        rotation, tip = kinematics.tip_rotation.copy(), kinematics.tip_position_m.copy()
        # Onto the plate well beside the hole, then down until it presses hard.
        beside = tip + 8e-3 * rotation[:, 0]
        ways = [tip + (beside - tip) * k / 140 for k in range(140)]
        ways += [beside + 5e-5 * k * rotation[:, 2] for k in range(400)]
        for place in ways:
            if rig.truth().peak_force_N > 1.3 * limit_N:
                break
            q = inverse.step(q, pin.SE3(rotation, place))[0]
            ports.clock.sleep_until(ports.clock.now_ns() + 1)
            ports.arm.send(JointCommand(q))
        assert 1.3 * limit_N < rig.truth().peak_force_N < 2.0 * limit_N
        way(ports, limit_N=limit_N)
        there = ports.joint_encoder.read().position_rad
    assert dist(there, APPROACH.poses_rad[-1]) < 5e-3


@pytest.mark.parametrize(
    ("first", "many", "arrives"), [(0, 10, True), (100, 30, True), (0, 40, False), (99, 40, False)]
)
def test_a_blind_arm_waits_where_it_is_and_not_for_ever(first, many, arrives):
    with SimulatedRig(CONFIG, ready_pose()) as rig:
        rig.prepare(0)
        reads = count(1)

        def dozing(sample):
            return replace(sample, validity=Validity.STALE) if next(reads) in range(first, first + many) else sample

        sensor = Altered(rig.ports.force_sensor, dozing)
        sent = SentCommands(rig.ports.arm)
        ports = replace(rig.ports, force_sensor=sensor, arm=sent)
        if arrives:
            way(ports, 0.2)
            assert dist(ports.joint_encoder.read().position_rad, APPROACH.poses_rad[-1]) < 5e-3
        else:
            with pytest.raises(DeviceError, match=r"force sample (is )?stale"):
                way(ports, 0.2)
        still = sum(a == b for a, b in pairwise(sent.requested))
    assert still >= (many if first and arrives else 0)


class HeldUpArm(DeviceDecorator, ArmCommand):
    """Does nothing for so many commands, from the given one on, and then goes on with the newest at once."""

    def __init__(self, arm, first, many):
        super().__init__(arm)
        self._arm, self._held, self.sent, self._last = arm, range(first, first + many), 0, AppliedCommand(())

    def send(self, command):
        self.sent += 1
        if self.sent not in self._held:
            self._last = self._arm.send(command)
        return self._last

    def stop(self):
        self._arm.stop()


@pytest.mark.parametrize("before_the_end", [5, 25])
def test_the_way_ends_where_the_arm_stands_and_not_where_it_passes_by(before_the_end):
    held = 20
    with SimulatedRig(CONFIG, ready_pose()) as rig:
        rig.prepare(0)
        counted = HeldUpArm(rig.ports.arm, 0, 0)
        way(replace(rig.ports, arm=counted))
    with SimulatedRig(CONFIG, ready_pose()) as rig:
        rig.prepare(0)
        late = HeldUpArm(rig.ports.arm, counted.sent - before_the_end - held, held)
        way(replace(rig.ports, arm=late))
        clock, encoder = rig.ports.clock, rig.ports.joint_encoder
        at_end = encoder.read().position_rad
        clock.sleep_until(clock.now_ns() + 30_000_000)
        moved_rad = np.subtract(encoder.read().position_rad, at_end)
        assert np.abs(moved_rad).max() < 1e-3
        assert rig.truth().peak_force_N < 20.0
