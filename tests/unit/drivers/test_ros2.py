"""Arm and force sensor behind ROS 2 in virtual time: joints by name, set-points, refusals, and what stops them."""

from dataclasses import replace
from itertools import pairwise
from math import nan

import pytest

from palpate.core.ports import CONTROL_RATE_HZ
from palpate.drivers.device import ArmState
from palpate.drivers.errors import DriverError, RefusedError, SettingError, WiringError
from palpate.drivers.ros2 import WRENCH, Ros2Arm, Ros2ArmSettings, Ros2Wrench
from palpate.drivers.ros2.judgement import StampClock
from tests.virtual_ros2 import HOME, NAMES, VirtualDomain

SETTINGS = Ros2ArmSettings(
    joints=NAMES, lower_rad=(-3.0,) * 6, upper_rad=(3.0,) * 6, velocity_rad_s=(1.0,) * 6,
    period_s=1.0 / CONTROL_RATE_HZ, start_s=0.2,
)  # fmt: skip
THERE = (*HOME[:5], HOME[5] + 0.1)


def made(domain, **settings):
    arm = Ros2Arm(domain.link(), replace(SETTINGS, **settings), now_ns=domain.clock.now_ns, sleep=domain.clock.sleep)
    arm.open()
    return arm


def lead(arm, domain, ticks, to=None):
    for _ in range(ticks):
        arm.cycle(to)
        domain.ticks(1)


@pytest.mark.parametrize("velocities", [False, True])
def test_arm_goes_where_it_is_led_and_holds_when_stopped(velocities):
    domain = VirtualDomain(velocities=velocities)
    arm = made(domain, velocities=velocities)
    arm.enable()
    lead(arm, domain, 200, THERE)
    assert domain.robot.targets_rad() == pytest.approx(THERE, abs=5e-4)
    lead(arm, domain, 3, HOME)
    arm.stop()
    domain.ticks(1)
    held = domain.robot.targets_rad()
    assert held != pytest.approx(HOME, abs=1e-3)
    lead(arm, domain, 5, HOME)
    assert domain.robot.targets_rad() == held
    arm.disable()
    domain.ticks(20)
    assert domain.robot.targets_rad() == held


@pytest.mark.parametrize(("stop_ms", "stood_s"), [(200.0, 0.18), (0.0, None)])
def test_robot_s_own_stop_is_timed_and_a_robot_without_one_is_stopped(stop_ms, stood_s):
    domain = VirtualDomain(velocities=True, stop_ms=stop_ms)
    arm = made(domain, velocities=True)
    arm.enable()
    found_s = arm.run_out()
    assert found_s == (stood_s and pytest.approx(stood_s, abs=0.02))
    domain.ticks(2)
    stopped, moved = domain.robot.targets_rad(), HOME[5] - domain.robot.targets_rad()[5]
    domain.ticks(20)
    assert domain.robot.targets_rad() == stopped
    assert moved == pytest.approx(0.01 * (0.5 + (found_s or 1.0)), abs=5e-4)


def test_robot_s_own_stop_is_not_tried_with_positions_nor_on_one_that_does_not_follow():
    domain = VirtualDomain()
    arm = made(domain)
    arm.enable()
    with pytest.raises(SettingError, match="of no use to positions"):
        arm.run_out()
    domain = VirtualDomain(velocities=True)
    domain.moves = False
    arm = made(domain, velocities=True)
    arm.enable()
    with pytest.raises(SettingError, match="wrist_3 does not follow a velocity"):
        arm.run_out()


def test_set_point_is_at_most_a_period_ahead_of_where_the_arm_is():
    domain = VirtualDomain()
    domain.moves = False
    arm = made(domain)
    arm.enable()
    lead(arm, domain, 20, THERE)
    ahead = [a - b for a, b in zip(domain.robot.targets_rad(), HOME, strict=True)]
    assert ahead == pytest.approx([0.0] * 5 + [SETTINGS.period_s], abs=1e-9)
    domain.robot.measured_rad((*HOME[:5], HOME[5] + 0.05))
    lead(arm, domain, 2, THERE)
    assert domain.robot.targets_rad()[5] == pytest.approx(HOME[5] + 0.05 + SETTINGS.period_s)


@pytest.mark.parametrize("requested", [(nan,) * 6, HOME[:5]])
def test_set_point_that_is_none_is_refused_without_a_fault(requested):
    domain = VirtualDomain()
    arm = made(domain)
    arm.enable()
    with pytest.raises(RefusedError):
        arm.cycle(requested)
    assert arm.state is ArmState.ENABLED


def test_changed_order_and_further_joints_are_followed():
    domain = VirtualDomain()
    arm = made(domain)

    def other(message):
        if hasattr(message, "name"):
            message.name, message.position = [*message.name[::-1], "gripper"], [*message.position[::-1], nan]
        return message

    domain.network = other
    lead(arm, domain, 2)
    assert arm.cycle().position_rad == HOME


def altered(**fields):
    """Joint states from now on have these fields."""

    def strike(domain):
        def network(message):
            for name, value in fields.items() if hasattr(message, "name") else ():
                setattr(message, name, value)
            return message

        domain.network = network

    return strike


def stepped(seconds):
    return lambda domain: setattr(domain, "stamp_ns", domain.stamp_ns + round(seconds * 1e9))


TROUBLES = {
    "silence": (lambda domain: setattr(domain, "is_plugged", False), "no message of /joint_states for 1"),
    "two publishers": (lambda domain: setattr(domain, "publishers", 2), "2 publishers send /joint_states; end all but"),
    "missing joint": (altered(name=["a"], position=[0.0]), "has no joint pan, lift.*it has a; set .arm. joints"),
    "NaN": (altered(position=[*HOME[:5], nan]), "joint wrist_3 of /joint_states is nan"),
    "wrong length": (altered(position=HOME[:5]), "6 names and 5 positions"),
    "clock set back": (stepped(-0.5), "stamps of /joint_states jump back by 0.498 s; synchronise clocks"),
    "clock set ahead": (stepped(0.5), r"stamps of /joint_states jump ahead by 0\.\d+ s; synchronise clocks"),
    "no time": (stepped(-1.7e9 - 1.0), "carry no time"),
    "controller gone": (
        lambda domain: setattr(domain.robot, "is_active", False), "no subscriber.*the controller is not active",
    ),
}  # fmt: skip


@pytest.mark.parametrize("trouble", TROUBLES)
def test_moving_arm_is_held_first_and_the_fault_stays_until_it_is_acknowledged(trouble):
    domain = VirtualDomain()
    strike, problem = TROUBLES[trouble]
    arm = made(domain)
    arm.enable()
    lead(arm, domain, 5, THERE)
    before_ns = domain.robot.command_ns
    strike(domain)
    with pytest.raises(DriverError, match=problem) as caught:
        lead(arm, domain, 40, THERE)
    assert "\n" not in str(caught.value)
    if trouble not in ("silence", "controller gone"):
        assert domain.robot.command_ns > before_ns
    held = domain.robot.targets_rad()
    assert held[5] < THERE[5]
    with pytest.raises(DriverError, match="a fault is latched"):
        arm.cycle(THERE)
    domain.ticks(10)
    assert domain.robot.targets_rad() == held
    domain.publishers, domain.is_plugged, domain.robot.is_active = 1, True, True
    domain.network = lambda message: message
    if trouble != "no time":
        arm.acknowledge()
        arm.enable()
        lead(arm, domain, 5, THERE)


REFUSALS = {
    "nobody": (lambda domain: setattr(domain, "publishers", 0), "no publisher of /joint_states in domain 0; start"),
    "wrong type": (
        lambda domain: (setattr(domain, "publishers", 0), domain.seen[0].append(("x/msg/Y", ""))),
        "/joint_states carries x/msg/Y, not sensor_msgs/msg/JointState",
    ),
    "silence": (lambda domain: setattr(domain, "network", lambda message: None), "no new message of /joint_states"),
}


@pytest.mark.parametrize("case", REFUSALS)
def test_robot_that_cannot_be_read_does_not_open(case):
    domain = VirtualDomain()
    REFUSALS[case][0](domain)
    with pytest.raises(DriverError, match=REFUSALS[case][1]):
        made(domain)


def test_controller_that_cannot_be_commanded_is_not_enabled():
    domain = VirtualDomain()
    arm = made(domain)
    domain.robot.is_active = False
    with pytest.raises(WiringError, match="ros2 control switch_controllers --activate"):
        arm.enable()
    domain.seen[1].append(("std_msgs/msg/Float64MultiArray", "Reliable, TransientLocal"))
    with pytest.raises(WiringError, match="wants std_msgs/msg/Float64MultiArray, Reliable, TransientLocal; offered"):
        arm.enable()
    domain.robot.is_active = True
    domain.robot.measured_rad((*HOME[:5], 3.1))
    domain.moves = False
    with pytest.raises(SettingError, match=r"wrist_3 stands at 3.1000 rad, outside -3.0000 to 3.0000"):
        arm.enable()


def test_times_are_the_stamps_on_this_clock_and_grow_whatever_the_delay():
    domain, clock = VirtualDomain(), StampClock("/t")

    def taken(stamp_ms, receive_ms):
        message = domain.idl.joint_state(domain.stamp_ns + stamp_ms * 10**6, (), ())
        return clock.times_ns([message], receive_ms * 10**6)[0]

    assert taken(0, 40) == 40 * 10**6
    assert taken(10, 45) == 45 * 10**6
    assert taken(20, 70) == pytest.approx(55 * 10**6, abs=10_000)
    assert taken(20, 71) == pytest.approx(55 * 10**6, abs=10_000)
    assert taken(21, 56 + 20) > 55 * 10**6


def opened(domain, frame="tool0"):
    link = domain.link("wrench", WRENCH, "")
    link.open()
    sensor = Ros2Wrench(link, frame)
    domain.ticks(2)
    return sensor


def with_force(value):
    def network(message):
        if hasattr(message, "wrench"):
            message.wrench.force.x = value
        return message

    return network


def framed(message):
    message.header.frame_id = "ft_frame"
    return message


WRENCH_TROUBLES = {
    "unknown frame": (
        lambda domain: setattr(domain, "network", framed),
        "/wrench is in frame 'ft_frame', the rig file says 'tool0'; set .force_sensor. frame if",
    ),
    "NaN": (lambda domain: setattr(domain, "network", with_force(nan)), "a wrench of /wrench is no number"),
    "two publishers": (lambda domain: setattr(domain, "publishers", 2), "2 publishers send /wrench"),
    "clock set back": (
        lambda domain: setattr(domain, "stamp_ns", domain.stamp_ns - 10**9), "stamps of /wrench jump back by 0.9",
    ),
    "silence": (lambda domain: setattr(domain, "is_plugged", False), "nothing new for 1"),
}  # fmt: skip


@pytest.mark.parametrize("trouble", WRENCH_TROUBLES)
def test_trouble_is_raised_in_one_line(trouble):
    domain = VirtualDomain()
    sensor = opened(domain)
    assert sensor.poll(domain.clock.now_ns())[-1].force_N == (0.0, 0.0, -5.0)
    sensor.check()
    WRENCH_TROUBLES[trouble][0](domain)
    domain.ticks(20)
    sensor.poll(domain.clock.now_ns())
    with pytest.raises(DriverError, match=WRENCH_TROUBLES[trouble][1]):
        sensor.check()


def test_samples_carry_the_times_of_their_stamps():
    domain = VirtualDomain()
    sensor = opened(domain)
    sensor.poll(domain.clock.now_ns())
    domain.ticks(1)
    times_ns = [sample.receive_time_ns for sample in sensor.poll(domain.clock.now_ns())]
    assert [b - a for a, b in pairwise(times_ns)] == pytest.approx([2e6] * (len(times_ns) - 1))
    assert domain.clock.now_ns() - times_ns[-1] < 2.1e6
