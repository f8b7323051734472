"""The Zebra on six scripted modules: life, cycles, faults, stops."""

import pytest

from palpate.drivers.device import ArmState
from palpate.drivers.errors import DeviceFaultError, GarbledError, SilentError, StateError, WiringError
from palpate.drivers.nmc import StopControl
from palpate.drivers.zebra_zero import FaultKind, JointLimits, Streaming, Transmission, ZebraZero, ZebraZeroSettings
from palpate.drivers.zebra_zero.codec import HOME_RAD
from palpate.drivers.zebra_zero.servos import StopOutcome
from tests.unit.drivers.nmc_line import Line, Module

PERIOD_S = 3 / 140
COUNTS = Transmission()


class Store:
    def __init__(self, counts=None):
        self.counts = counts

    def load(self):
        return self.counts

    def save(self, counts):
        self.counts = counts


def arm_on(line, *, at_home=True, store=None, **settings):
    made = ZebraZeroSettings(control_rate_Hz=140, **settings)
    return ZebraZero(line, line.clock, line.clock.sleep, made, at_home=at_home, store=store)


def ready(line, **settings):
    arm = arm_on(line, **settings)
    arm.open()
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


def showing(module, status):
    """From now on the module shows this status."""
    module.__class__ = type("Showing", (type(module),), {"status": property(status)})


@pytest.fixture
def line():
    return Line()


def test_closed_arm_is_held_by_its_modules(line):
    arm = running(line)
    arm.stop()
    assert (arm.state, arm.stopped) == (ArmState.STOPPED, StopOutcome.STATIONARY)
    arm.close()
    arm.close()
    assert arm.state is ArmState.CLOSED
    assert all(module.is_on for module in line.modules)


def test_axis_is_switched_on_in_the_documented_order(line):
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
    tick(arm, line, moved(0.5), times=11)
    first = arm.setpoint_rad[0]
    arm.cycle(moved(0.5))
    assert 0.0 <= arm.setpoint_rad[0] - first < 0.006


def test_arm_is_taken_over_from_stored_counts(line):
    store = Store()
    arm = running(line, store=store)
    tick(arm, line, moved(0.2), times=30)
    arm.close()
    resets = line.modules[0].resets
    for wrong in ((5000, *store.counts[1:]), store.counts[:5]):
        with pytest.raises(WiringError, match="stored were"):
            ready(line, store=Store(wrong))
    with pytest.raises(StateError, match="on since an earlier run"):
        ready(line)
    again = ready(line, store=store, at_home=False)
    assert again.cycle().position_rad == pytest.approx(moved(0.2), abs=1e-4)
    again.enable()
    assert line.modules[0].resets == resets
    assert all(module.is_on for module in line.modules)
    # After a reset, earlier counts mean nothing.
    with pytest.raises(StateError, match="at_home=True"):
        ready(Line(), store=Store((1,) * 6), at_home=False)


@pytest.mark.parametrize("kinds", [(0,) * 5, (0,) * 7, (0, 0, 0, 2, 0, 0)])
def test_modules_of_another_number_or_kind_are_refused(kinds):
    with pytest.raises(WiringError, match="found"):
        ready(Line([Module(kind=kind) for kind in kinds]))


def test_motor_supply_that_is_off_keeps_the_servos_off(line):
    arm = ready(line)
    line.modules[2].power = False
    with pytest.raises(DeviceFaultError, match="motor 3: motor supply is off"):
        arm.enable()
    assert not any(module.is_on for module in line.modules)
    line.modules[2].power = True
    arm.acknowledge()
    arm.enable()


def test_pose_beyond_a_limit_is_not_switched_on(line):
    arm = ready(line, limits=JointLimits(upper_rad=(3.14, 1.5, 1.07, 3.14, 3.14, 3.14)))
    with pytest.raises(DeviceFaultError, match=r"joint 2 at 1\.5708 rad"):
        arm.enable()
    assert arm.is_faulted


def test_impossible_jump_is_not_believed_once_and_a_fault_twice(line):
    arm = running(line)
    tick(arm, line, times=3)
    place(line, moved(1.0))
    measured = tick(arm, line)
    assert measured.position_rad == HOME_RAD
    with pytest.raises(GarbledError, match="cannot have reached"):
        tick(arm, line)
    assert arm.is_faulted


@pytest.mark.parametrize(
    ("flag", "kind"),
    [
        ("overcurrent", FaultKind.OVERCURRENT),
        ("pos_error", FaultKind.POSITION_ERROR),
        ("limit", FaultKind.LIMIT_INPUT),
        ("overrun", FaultKind.SERVO_OVERRUN),
    ],
)
def test_fault_latches_stops_and_waits_for_a_person(line, flag, kind):
    arm = running(line)
    setattr(line.modules[3], flag, True)
    if flag == "pos_error":
        line.modules[3].is_on = False
    with pytest.raises(DeviceFaultError, match=f"motor 4: {kind.value}"):
        tick(arm, line, moved(0.01))
    sent = len(line.sent)
    for action in (arm.cycle, arm.enable, arm.disable):
        with pytest.raises(DeviceFaultError, match=f"latched.*motor 4: {kind.value}"):
            action()
    assert len(line.sent) == sent
    if flag == "limit":
        with pytest.raises(DeviceFaultError):
            arm.acknowledge()
        assert arm.is_faulted
        line.modules[3].limit = False
    arm.acknowledge()
    assert (arm.state, arm.fault) == (ArmState.CONFIGURED, None)
    arm.enable()
    tick(arm, line, moved(0.005))


def test_stop_does_not_switch_a_tripped_motor_on_again(line):
    arm = running(line)
    for number in (1, 4):
        line.modules[number].is_on, line.modules[number].pos_error = False, True
    with pytest.raises(DeviceFaultError, match="motor 2"):
        tick(arm, line)
    arm.stop()
    assert [module.is_on for module in line.modules] == [True, False, True, True, False, True]


def test_servo_that_went_off_without_an_error_is_a_fault(line):
    arm = running(line)
    showing(line.modules[0], lambda module: Module.status.fget(module) & ~0x10)
    line.modules[0].is_on = False
    with pytest.raises(DeviceFaultError, match="the servo is off"):
        tick(arm, line)


def test_power_lost_leaves_the_motors_off(line):
    arm = running(line)
    for module in line.modules:
        module.power = False
    with pytest.raises(DeviceFaultError, match="supply"):
        tick(arm, line)
    assert not any(module.is_on for module in line.modules)


def test_measured_pose_beyond_a_limit_is_a_fault(line):
    arm = running(line)
    place(line, moved(0.125, joint=1))
    tick(arm, line, times=3)
    place(line, moved(0.16, joint=1))
    with pytest.raises(DeviceFaultError, match=r"joint 2 at 1\.73"):
        tick(arm, line)
    place(line, moved(0.0))
    arm.acknowledge()
    arm.enable()


@pytest.mark.parametrize(
    ("modules", "error", "message"),
    [(slice(2, 3), SilentError, "home pose"), (slice(6), WiringError, "not known any more")],
)
def test_reset_of_modules_in_mid_run_loses_the_position(line, modules, error, message):
    arm, begin = running(line), line.clock.ns
    for module in line.modules[modules]:
        module.reset()
    with pytest.raises(SilentError):
        tick(arm, line, times=2)
    assert (line.clock.ns - begin) * 1e-9 < 0.6
    with pytest.raises(error, match=message):
        arm.acknowledge()
    assert arm.is_faulted


@pytest.mark.parametrize(
    ("mangle", "error"), [(lambda reply: [], SilentError), (lambda reply: [(0.0, reply[:-1])], GarbledError)]
)
def test_line_without_good_replies_stops_the_arm_but_for_so_long_only(line, mangle, error):
    arm = running(line)
    line.mangle = mangle
    begin = line.clock.ns
    with pytest.raises(error):
        tick(arm, line)
    assert (arm.is_faulted, arm.stopped) == (True, StopOutcome.LINE_DEAD)
    assert (line.clock.ns - begin) * 1e-9 < 0.6
    # A line that carries but one way still does its work.
    assert all(module.seen[-2:] == [(7, b"\x05")] * 2 for module in line.modules)
    sent, begin = len(line.sent), line.clock.ns
    arm.stop()
    arm.close()
    assert (len(line.sent), line.clock.ns) == (sent, begin)


def test_stop_is_smooth_to_all_at_once_and_then_checked(line):
    arm = running(line)
    sent = len(line.sent)
    arm.stop()
    frames = [frame.hex() for frame in line.sent[sent:]]
    stop = bytes((StopControl.AMP_ENABLE | StopControl.SMOOTH,)).hex()
    assert frames[0] == f"aaff17{stop}1f"
    assert sum(frame.startswith("aa") and frame[4:8] == f"17{stop}" for frame in frames) == 7


def test_group_stop_that_is_lost_is_made_up_for(line):
    arm = running(line)
    for module in line.modules:
        module.speed_counts = 50
    tick(arm, line, moved(0.4), times=5)
    for module in line.modules:
        module.group = 0x80
    arm.stop()
    assert arm.stopped is StopOutcome.STATIONARY
    assert all(module.counts == module.target for module in line.modules)


@pytest.mark.parametrize("end", [ZebraZero.stop, ZebraZero.disable])
def test_arm_that_is_not_seen_at_rest_is_stopped_abruptly_and_a_fault(line, end):
    arm = running(line)
    showing(line.modules[5], lambda module: 0x08)
    end(arm)
    assert (7, b"\x05") in line.modules[5].seen[-3:]
    assert (arm.stopped, arm.is_faulted) == (StopOutcome.NOT_SEEN, True)
    assert "not every motor was seen stationary" in arm.fault


def test_interrupt_anywhere_in_a_cycle_ends_in_a_stop():
    for where in range(6):
        line = Line()
        arm = running(line)
        left = [where]

        def read(size=1, line=line, left=left):
            left[0] -= 1
            if left[0] < 0:
                line.read = lambda size=1: Line.read(line, size)
                raise KeyboardInterrupt
            return Line.read(line, size)

        line.read = read
        with pytest.raises(KeyboardInterrupt):
            tick(arm, line, moved(0.3))
        assert arm.state is ArmState.STOPPED
        assert all(module.counts == module.target and module.is_on for module in line.modules)
        assert all(any(seen == (7, b"\x09") for seen in module.seen) for module in line.modules)
