"""The arm behind its link, in virtual time: refusals, faults by name, a connection that breaks and is made again."""

from dataclasses import replace
from math import nan

import pytest

from palpate.core.ports import CONTROL_RATE_HZ
from palpate.drivers.device import ArmState
from palpate.drivers.errors import DriverError, LateError, RefusedError, SettingError, SilentError, WiringError
from palpate.drivers.ur import UrArm, UrSettings
from palpate.simulation.emulators.ur.controller import RobotMode, SafetyMode
from tests.virtual_ur import HOME, VirtualUr

SETTINGS = UrSettings(
    lower_rad=(-3.0,) * 6, upper_rad=(3.0,) * 6, velocity_rad_s=(1.0,) * 6, period_s=1.0 / CONTROL_RATE_HZ,
    force_stop_N=20.0,
)  # fmt: skip


def made(ur, **settings):
    return UrArm(ur, replace(SETTINGS, **settings), now_ns=ur.clock.now_ns, sleep=ur.clock.sleep)


def enabled(ur):
    arm = made(ur)
    arm.open()
    arm.enable()
    return arm


def lead(arm, ur, ticks, to=None):
    for _ in range(ticks):
        arm.cycle(to)
        ur.ticks(1)


def test_arm_goes_where_it_is_led_no_faster_than_allowed_and_stops():
    ur = VirtualUr()
    arm, there = enabled(ur), (*HOME[:5], HOME[5] + 0.1)
    arm.cycle(there)
    assert HOME[5] < arm.setpoint_rad[5] < there[5]
    lead(arm, ur, 60, there)
    assert ur.controller.targets_rad() == pytest.approx(there, abs=1e-4)
    arm.stop()
    lead(arm, ur, 5, HOME)
    assert arm.setpoint_rad == pytest.approx(there, abs=1e-9)
    assert ur.controller.stationary
    with pytest.raises(RefusedError):
        arm.cycle((float("nan"),) * 6)


TROUBLES = [
    (
        lambda ur: ur.controller.protective_stop(),
        "protective stop; clear what the arm has met, and unlock it on the pendant",
    ),
    (
        lambda ur: ur.controller.emergency_stop(),
        "emergency stop of the robot; release the button, power on and release the brakes",
    ),
    (
        lambda ur: setattr(ur.controller, "safety_mode", SafetyMode.SAFEGUARD_STOP),
        "safeguard stop; close the safeguard",
    ),
    (lambda ur: setattr(ur.controller, "safety_mode", SafetyMode.FAULT), "safety fault; read the controller's log"),
    (lambda ur: ur.controller.reboot(), "power off; power on and release the brakes"),
    (lambda ur: ur.controller.end_program(), "at the pendant, or by a switch to local control; switch back to remote"),
    (lambda ur: setattr(ur, "is_silent", True), "no data for"),
    (lambda ur: setattr(ur.controller, "robot_mode", 42), "sends makes no sense: robot mode 42"),
    (lambda ur: ur.load.__setitem__(2, nan), "sends makes no sense: what should be numbers is none"),
    (lambda ur: setattr(ur, "is_plugged", False), "unplugged"),
    (lambda ur: ur.load.__setitem__(2, -40.0), "changed by 35.0 N, beyond [arm] force_stop_N = 20"),
]


def test_idle_arm_shows_its_pose_and_its_controller_whatever_the_safety_mode():
    ur = VirtualUr()
    arm = made(ur)
    assert {"controller", "payload"}.isdisjoint(arm.diagnostics())
    arm.open()
    ur.controller.emergency_stop()
    ur.ticks(1)
    assert arm.cycle().position_rad == HOME
    found = arm.diagnostics()
    assert found["controller"] == "PolyScope URSoftware 5.11.1.108318 (Jan 01 2021), robot 20205500001"
    assert (found["state"], found["fault"], found["newest data"]) == ("configured", "", "0 ms old")


def test_late_data_keep_their_time_and_are_no_fault_of_the_arm_if_this_computer_was_away():
    ur = VirtualUr()
    arm = enabled(ur)
    lead(arm, ur, 5)
    ur.is_silent = True
    since_ns = ur.clock.now_ns()
    ur.clock.sleep(0.05)
    assert since_ns - 10_000_000 < arm.cycle().time_ns <= since_ns
    assert ur.clock.now_ns() >= since_ns + 70_000_000  # it has waited for newer ones
    ur.clock.sleep(0.2)
    with pytest.raises(LateError, match=r"this computer was away for 2\d\d ms"):
        arm.cycle()
    assert arm.state is ArmState.FAULTED


def test_trouble_of_a_stopped_arm_is_latched_too():
    ur = VirtualUr()
    arm = enabled(ur)
    lead(arm, ur, 5)
    arm.stop()
    lead(arm, ur, 30)  # the program's end, by the stop itself, is none
    ur.controller.emergency_stop()
    with pytest.raises(DriverError, match="emergency stop of the robot"):
        lead(arm, ur, 5)
    assert arm.state is ArmState.FAULTED


@pytest.mark.parametrize(("strike", "message"), TROUBLES, ids=[message for _, message in TROUBLES])
def test_trouble_stops_the_arm_within_a_second_is_latched_and_named(strike, message):
    ur = VirtualUr()
    arm = enabled(ur)
    lead(arm, ur, 5, (*HOME[:5], 2.0))
    strike(ur)
    since_ns = ur.clock.now_ns()
    with pytest.raises(DriverError) as raised:
        lead(arm, ur, 200, (*HOME[:5], 2.0))
    ur.clock.sleep(0.4)
    assert message in str(raised.value)
    assert arm.state is ArmState.FAULTED
    assert message in (arm.fault or "")
    assert ur.controller.stationary
    assert ur.clock.now_ns() - since_ns < 1_200_000_000
    with pytest.raises(DriverError, match="a fault is latched"):
        arm.cycle()


def test_protective_stop_is_unlocked_by_a_person_when_the_controller_allows_it():
    ur = VirtualUr()
    arm = enabled(ur)
    ur.controller.protective_stop()
    with pytest.raises(DriverError):
        lead(arm, ur, 5)
    with pytest.raises(WiringError, match="until 5s after"):
        arm.acknowledge()
    assert arm.state is ArmState.FAULTED
    ur.clock.sleep(5.0)
    arm.acknowledge()
    arm.enable()
    lead(arm, ur, 5)


def test_connection_that_breaks_at_rest_is_made_again_and_one_in_motion_waits_for_a_person():
    ur = VirtualUr()
    arm = enabled(ur)
    arm.stop()
    ur.is_plugged = False
    lead(arm, ur, 30)
    arm.disable()
    ur.is_plugged, ur.is_open = True, False
    arm.enable()
    assert ur.opened == 2
    ur.is_open = False
    with pytest.raises(SilentError):
        lead(arm, ur, 1)
    with pytest.raises(DriverError, match="latched"):
        arm.enable()
    arm.acknowledge()
    arm.enable()
    lead(arm, ur, 5)


@pytest.mark.parametrize(
    ("controller", "message"),
    [({"version": (5, 8, 0, 1)}, "5.8.0.1.*untried"), ({"version": (10, 7, 0, 1)}, "10.7.0.1.*untried")],
)
def test_controller_that_is_set_up_otherwise_is_refused(controller, message):
    with pytest.raises(SettingError, match=message):
        made(VirtualUr(**controller)).open()


def test_controller_in_local_control_without_power_or_beyond_its_limits_is_refused():
    ur = VirtualUr()
    ur.controller.remote = False
    with pytest.raises(SettingError, match="local control; switch the pendant"):
        made(ur).open()
    ur.controller.remote, ur.controller.robot_mode = True, RobotMode.IDLE
    with pytest.raises(SettingError, match="brakes on"):
        made(ur).open()
    ur.controller.robot_mode = RobotMode.RUNNING
    arm = made(ur, upper_rad=(0.0,) * 6)
    arm.open()
    with pytest.raises(SettingError, match=r"joint 1 is at 0\.1000 rad"):
        arm.enable()


def test_controller_ends_the_program_of_a_host_that_is_gone():
    ur = VirtualUr()
    arm = enabled(ur)
    lead(arm, ur, 20, (*HOME[:5], 2.0))
    assert not ur.controller.stationary
    ur.clock.sleep(0.4)
    assert ur.controller.stationary
