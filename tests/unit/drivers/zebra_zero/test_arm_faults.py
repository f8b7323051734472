import pytest

from palpate.drivers.errors import DeviceFaultError, GarbledError, SilentError, StateError, WiringError
from palpate.drivers.nmc.frames import StopControl
from palpate.drivers.zebra_zero.servos import StopOutcome
from palpate.drivers.zebra_zero.states import FaultKind, ZebraState
from tests.unit.drivers.nmc.line import Line
from tests.unit.drivers.zebra_zero.test_arm import moved, place, ready, running, tick

FAULTS = {
    "overcurrent": ("overcurrent", FaultKind.OVERCURRENT),
    "pos_error": ("pos_error", FaultKind.POSITION_ERROR),
    "limit": ("limit", FaultKind.LIMIT_INPUT),
    "overrun": ("overrun", FaultKind.SERVO_OVERRUN),
}


@pytest.fixture
def line():
    return Line()


@pytest.mark.parametrize(("flag", "kind"), FAULTS.values(), ids=FAULTS)
def test_fault_latches_stops_and_waits_for_a_person(line, flag, kind):
    arm = running(line)
    setattr(line.modules[3], flag, True)
    if flag == "pos_error":
        line.modules[3].is_on = False
    with pytest.raises(DeviceFaultError, match="motor 4"):
        tick(arm, line, moved(0.01))
    assert (arm.state, arm.fault.kind, arm.fault.axis) == (ZebraState.FAULTED, kind, 4)
    sent = len(line.sent)
    for action in (arm.cycle, arm.enable):
        with pytest.raises((DeviceFaultError, StateError)):
            action()
    assert len(line.sent) == sent
    if flag == "limit":
        with pytest.raises(DeviceFaultError):
            arm.acknowledge()
        assert arm.state is ZebraState.FAULTED
        arm.release()
        line.modules[3].limit = False
    arm.acknowledge()
    assert (arm.state, arm.fault) == (ZebraState.STOPPED, None)
    arm.enable()
    tick(arm, line, moved(0.005))


def test_stop_does_not_switch_a_tripped_motor_on_again(line):
    arm = running(line)
    for number in (1, 4):
        line.modules[number].is_on, line.modules[number].pos_error = False, True
    with pytest.raises(DeviceFaultError, match="motor 2"):
        tick(arm, line)
    arm.smooth_stop()
    assert [module.is_on for module in line.modules] == [True, False, True, True, False, True]


def test_servo_that_went_off_without_a_word(line):
    arm = running(line)
    ordinary = type(line.modules[0]).status.fget

    class Quiet(type(line.modules[0])):
        @property
        def status(self):
            return ordinary(self) & ~0x10

    line.modules[0].__class__ = Quiet
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
    assert arm.fault.kind is FaultKind.POWER_LOST


def test_power_and_limit_bits_can_be_told_not_to_count(line):
    arm = running(line, require_power=False, use_limit_inputs=False)
    for module in line.modules:
        module.power, module.limit = False, True
    tick(arm, line)


def test_measured_pose_beyond_a_limit(line):
    arm = running(line)
    place(line, moved(0.125, joint=1))
    tick(arm, line, times=3)
    place(line, moved(0.16, joint=1))
    with pytest.raises(DeviceFaultError, match=r"joint 2 at 1\.73"):
        tick(arm, line)
    assert arm.fault.kind is FaultKind.OUT_OF_LIMITS
    arm.release()
    place(line, moved(0.0))
    arm.acknowledge()
    arm.enable()


def test_one_lost_reply_is_no_fault_and_two_are(line):
    arm = running(line)
    line.modules[2].address = 0x70
    assert tick(arm, line).is_fresh == (True, True, False, True, True, True)
    with pytest.raises(SilentError, match="module 3"):
        tick(arm, line)
    assert arm.fault.kind is FaultKind.COMMUNICATION
    line.modules[2].address = 3
    arm.acknowledge()
    assert arm.state is ZebraState.STOPPED
    arm.enable()


def test_module_reset_in_mid_run_loses_the_position(line):
    arm = running(line)
    line.modules[2].reset()
    with pytest.raises(SilentError):
        tick(arm, line, times=2)
    with pytest.raises(SilentError, match="home pose"):
        arm.acknowledge()
    assert arm.state is ZebraState.FAULTED
    arm.close()
    arm.connect(reset=True)
    arm.confirm_home(at_home=True)


def test_all_modules_reset_in_mid_run(line):
    arm = running(line)
    for module in line.modules:
        module.reset()
    with pytest.raises(SilentError):
        tick(arm, line, times=2)
    with pytest.raises(WiringError, match="not known any more"):
        arm.acknowledge()
    assert arm.state is ZebraState.FAULTED


def test_an_acknowledgement_while_nobody_answers_may_be_repeated(line):
    arm = running(line)
    for module in line.modules:
        module.address += 0x40
    with pytest.raises(SilentError):
        tick(arm, line, times=2)
    for _ in range(2):
        with pytest.raises(WiringError, match="mend cable or supply and acknowledge again"):
            arm.acknowledge()
    for module in line.modules:
        module.address -= 0x40
    arm.acknowledge()
    arm.enable()
    tick(arm, line)


@pytest.mark.parametrize(
    ("mangle", "error"),
    [
        (lambda reply: [], SilentError),
        (lambda reply: [(0.0, reply[:-1])], GarbledError),
        (lambda reply: [(0.0, reply[:-1] + bytes((reply[-1] ^ 0x55,)))], GarbledError),
        (lambda reply: [(0.0, bytes(len(reply)))], GarbledError),
    ],
)
def test_bad_line(line, mangle, error):
    arm = running(line)
    line.mangle = mangle
    with pytest.raises(error):
        tick(arm, line)
    assert arm.state is ZebraState.FAULTED
    assert arm.smooth_stop() is StopOutcome.LINE_DEAD


def test_stop_is_smooth_to_all_at_once_and_then_checked(line):
    arm = running(line)
    sent = len(line.sent)
    arm.smooth_stop()
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
    assert arm.smooth_stop() is StopOutcome.AT_REST
    assert all(module.counts == module.target for module in line.modules)


def test_arm_that_is_not_seen_at_rest_is_stopped_abruptly_and_a_fault(line):
    arm = running(line)

    class Restless(type(line.modules[0])):
        @property
        def status(self):
            return 0x08

    line.modules[5].__class__ = Restless
    assert arm.smooth_stop() is StopOutcome.NOT_SEEN
    assert (7, b"\x05") in line.modules[5].seen[-3:]
    assert (arm.state, arm.fault.kind) == (ZebraState.FAULTED, FaultKind.STOP_NOT_SEEN)


def test_dead_line_holds_a_stop_up_only_for_so_long(line):
    arm = running(line)
    line.mangle = lambda reply: []
    begin = line.clock.ns
    assert arm.smooth_stop() is StopOutcome.LINE_DEAD
    assert (line.clock.ns - begin) * 1e-9 < 0.5
    assert arm.state is ZebraState.FAULTED
    # A line that carries but one way still does its work.
    assert all(module.seen[-2:] == [(7, b"\x05")] * 2 for module in line.modules)
    sent, begin = len(line.sent), line.clock.ns
    assert arm.smooth_stop() is StopOutcome.LINE_DEAD
    arm.close()
    assert (len(line.sent), line.clock.ns) == (sent, begin)


def test_interrupt_anywhere_in_a_cycle_ends_in_a_stop():
    """Ctrl-C at each read of a cycle in turn: leaving the context always stops the arm."""
    for where in range(6):
        line = Line()
        left = [where]

        def read(size=1, line=line, left=left):
            left[0] -= 1
            if left[0] < 0:
                line.read = lambda size=1: Line.read(line, size)
                raise KeyboardInterrupt
            return Line.read(line, size)

        arms = []

        def work(line=line, read=read, arms=arms):
            with running(line) as arm:
                line.read = read
                arms.append(arm)
                tick(arm, line, moved(0.3))

        with pytest.raises(KeyboardInterrupt):
            work()
        (arm,) = arms
        assert arm.state is ZebraState.CLOSED
        assert all(module.counts == module.target and module.is_on for module in line.modules)
        assert all(any(seen == (7, b"\x09") for seen in module.seen) for module in line.modules)


def test_release_that_is_not_confirmed(line):
    arm = ready(line)
    line.modules[1].address = 0x70
    with pytest.raises(SilentError, match=r"motors \[2\]"):
        arm.release()
