"""The arm on six scripted modules: life, cycles, limits."""

import pytest

from palpate.drivers.device import AppliedReason
from palpate.drivers.errors import (
    DeviceFaultError,
    GarbledError,
    SettingError,
    SilentError,
    StateError,
    WiringError,
)
from palpate.drivers.nmc.settings import BusSettings
from palpate.drivers.zebra_zero import FaultKind, JointLimits, Streaming, Transmission, ZebraZero, ZebraZeroSettings
from palpate.drivers.zebra_zero.counts import HOME_RAD
from palpate.drivers.zebra_zero.servos import StopOutcome
from palpate.drivers.zebra_zero.states import ZebraState
from tests.unit.drivers.nmc.line import Line, Module

PERIOD_S = 3 / 140
COUNTS = Transmission()


def arm_on(line, **settings):
    return ZebraZero(line, line.clock, line.clock.sleep, ZebraZeroSettings(control_rate_Hz=140, **settings))


def ready(line, **settings):
    arm = arm_on(line, **settings)
    arm.connect()
    arm.confirm_home(at_home=True)
    return arm


def running(line, **settings):
    arm = ready(line, **settings)
    arm.enable()
    return arm


def tick(arm, line, setpoint=None, times=1):
    for _ in range(times):
        line.clock.sleep(PERIOD_S)
        measured = arm.cycle(setpoint)
    return measured


def moved(step_rad, joint=0):
    return tuple(q + step_rad * (j == joint) for j, q in enumerate(HOME_RAD))


def place(line, pose):
    for module, counts in zip(line.modules, COUNTS.to_counts(pose), strict=True):
        module.counts = module.target = counts


@pytest.fixture
def line():
    return Line()


def test_every_step_in_its_order(line):
    arm = arm_on(line)
    for action in (
        lambda: arm.confirm_home(at_home=True),
        lambda: arm.resume((0,) * 6),
        arm.enable,
        arm.cycle,
        arm.release,
        arm.acknowledge,
    ):
        with pytest.raises(StateError):
            action()
    arm.connect()
    with pytest.raises(StateError):
        arm.connect()
    with pytest.raises(StateError):
        arm.cycle()
    with pytest.raises(StateError, match="at_home=True"):
        arm.confirm_home(at_home=False)
    assert (arm.state, arm.stored_counts) == (ZebraState.CONNECTED, None)
    arm.confirm_home(at_home=True)
    with pytest.raises(StateError):
        arm.cycle(HOME_RAD)
    assert arm.cycle().position_rad == HOME_RAD
    arm.enable()
    assert arm.state is ZebraState.SERVO_ON
    assert arm.smooth_stop() is StopOutcome.AT_REST
    assert arm.state is ZebraState.STOPPED
    arm.release()
    assert arm.state is ZebraState.HOMED
    assert not any(module.is_on for module in line.modules)


def test_sequence_of_one_axis(line):
    """Motor off is 0x02; then hold here with the amplifier on; bits are cleared; a profile to the same place."""
    arm = ready(line)
    line.modules[0].seen.clear()
    arm.enable()
    seen = [(code, data.hex()) for code, data in line.modules[0].seen if code != 3]
    assert seen[:5] == [(2, "09"), (6, "6400e80300000000ff00a00f0100"), (7, "02"), (7, "05"), (0xB, "")]
    code, data = seen[5]
    assert (code, data[:10]) == (4, "9700000000")
    assert int.from_bytes(bytes.fromhex(data[10:18]), "little") == round(1.25 * 1_025_348.2)


def test_streaming_follows_the_documented_firmware(line):
    assert running(line).streaming is Streaming.TRAPEZOID
    other = Line([Module(version=10 if number else 5) for number in range(6)])
    assert running(other).streaming is Streaming.STOP_HERE


def test_cycle_that_comes_too_soon_takes_a_shorter_step(line):
    arm = running(line)
    tick(arm, line, moved(0.5), times=10)
    first = tick(arm, line, moved(0.5)).applied.position_rad[0]
    second = arm.cycle(moved(0.5)).applied.position_rad[0]
    assert 0.0 <= second - first < 0.006


def test_preview_is_what_a_punctual_cycle_applies(line):
    arm = running(line)
    for asked in (moved(0.001), moved(0.5), moved(9.0, joint=1)):
        line.clock.sleep(PERIOD_S)
        foreseen = arm.preview(asked)
        assert arm.cycle(asked).applied == foreseen
    arm.smooth_stop()
    assert arm.preview(moved(0.1)).reason is AppliedReason.STOPPED


def test_resume_from_stored_counts(line):
    with running(line) as arm:
        tick(arm, line, moved(0.2), times=30)
    stored = arm.stored_counts
    assert all(module.is_on for module in line.modules)
    again = arm_on(line)
    again.connect()
    resets = line.modules[0].resets
    with pytest.raises(WiringError, match="stored were"):
        again.resume((5000, *stored[1:]))
    with pytest.raises(WiringError):
        again.resume(stored[:5])
    again.resume(stored)
    assert again.cycle().position_rad == pytest.approx(moved(0.2), abs=1e-4)
    again.enable()
    assert line.modules[0].resets == resets
    assert all(module.is_on for module in line.modules)


def test_stored_counts_mean_nothing_after_a_reset(line):
    arm = arm_on(line)
    arm.connect()
    with pytest.raises(WiringError, match="reset"):
        arm.resume((0,) * 6)


def test_connect_with_reset_switches_off_what_was_left_on(line):
    with running(line):
        pass
    arm = arm_on(line)
    arm.connect(reset=True)
    assert not any(module.is_on for module in line.modules)


@pytest.mark.parametrize(
    "modules",
    [
        [Module() for _ in range(5)],
        [Module() for _ in range(7)],
        [Module(kind=2 if number == 3 else 0) for number in range(6)],
    ],
)
def test_wrong_modules(modules):
    with pytest.raises(WiringError, match="found"):
        arm_on(Line(modules)).connect()


def test_rate_that_the_bus_cannot_carry_is_refused():
    with pytest.raises(SettingError, match=r"62\.79 Hz at most with 10% in reserve; choose a fitting"):
        ZebraZeroSettings(control_rate_Hz=140, divider=1)
    ZebraZeroSettings(control_rate_Hz=140, divider=1, bus=BusSettings(baud=230_400, adapter_latency_s=0.0))


@pytest.mark.parametrize(
    "wrong",
    [
        {"divider": 0},
        {"reserve": 1.0},
        {"reply_items": 8},
        {"limit_tolerance_rad": -1.0},
        {"stored_tolerance_counts": -1},
        {"profile_margin": 0.5},
        {"stop_timeout_s": 0.0},
        {"bus": BusSettings(max_modules=5)},
    ],
)
def test_settings_that_cannot_work(wrong):
    with pytest.raises(SettingError):
        ZebraZeroSettings(control_rate_Hz=140, **wrong)


def test_no_motor_supply_at_switching_on(line):
    arm = ready(line)
    line.modules[2].power = False
    with pytest.raises(DeviceFaultError, match="motor 3: motor supply is off"):
        arm.enable()
    assert not any(module.is_on for module in line.modules)
    line.modules[2].power = True
    arm.acknowledge()
    arm.enable()
    assert arm.state is ZebraState.SERVO_ON


def test_pose_beyond_a_limit_is_not_switched_on(line):
    arm = ready(line, limits=JointLimits(upper_rad=(3.14, 1.5, 1.07, 3.14, 3.14, 3.14)))
    with pytest.raises(DeviceFaultError, match=r"joint 2 at 1\.5708 rad"):
        arm.enable()
    assert arm.fault.kind is FaultKind.OUT_OF_LIMITS


def test_counter_that_does_not_take_the_zero(line):
    arm = arm_on(line)
    arm.connect()
    module = line.modules[4]
    ordinary = module.obey
    module.obey = lambda code, data: (ordinary(code, data), setattr(module, "counts", 9999))[0]
    with pytest.raises(WiringError, match="motor 5 counts 9999"):
        arm.confirm_home(at_home=True)


def test_bus_that_fails_while_switching_on(line):
    arm = ready(line)
    line.modules[3].reset()
    with pytest.raises(SilentError, match="module 4"):
        arm.enable()
    assert arm.fault.kind is FaultKind.COMMUNICATION
    with pytest.raises(DeviceFaultError):
        arm.cycle()


def test_impossible_jump_is_not_believed_once_and_a_fault_twice(line):
    arm = running(line)
    tick(arm, line, times=3)
    place(line, moved(1.0))
    measured = tick(arm, line)
    assert measured.is_fresh == (False, True, True, True, True, True)
    assert measured.position_rad == HOME_RAD
    with pytest.raises(GarbledError, match="cannot have reached"):
        tick(arm, line)
    assert arm.state is ZebraState.FAULTED
