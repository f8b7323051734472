"""The arm of CiA 402 drives: life, cycles, stops; every fault stops it and stays until a person acknowledges it."""

import itertools
from functools import partial
from math import nan

import pytest
from canopen.sdo import SdoAbortedError

from palpate.drivers.device import ArmState
from palpate.drivers.errors import (
    DeviceFaultError,
    DriverError,
    LateError,
    RefusedError,
    SilentError,
    StateError,
    WiringError,
)
from palpate.simulation.emulators.cia402.node import NmtState
from palpate.simulation.emulators.cia402.objects import ABORT_NO_OBJECT
from palpate.simulation.emulators.cia402.servo import PowerState
from palpate.simulation.emulators.lines.can_bus import BusFrame
from tests.support.cia402_bench import SCALE, Bench, flipped, lost, mute, on_answers

STATIONARY = {PowerState.QUICK_STOP, PowerState.SWITCH_ON_DISABLED, PowerState.FAULT, PowerState.FAULT_REACTION}


def test_drive_left_under_power_by_a_dead_program_is_stopped_first():
    bench = Bench(host_watchdog_ms=60_000).enabled()
    again = Bench()
    again.drives = again.network.nodes = bench.drives
    again.network.now_ns = bench.network.now_ns
    assert bench.drives[0].machine.state is PowerState.ENABLED
    again.arm.open()
    assert {drive.machine.state for drive in bench.drives} == {PowerState.SWITCH_ON_DISABLED}


def test_enabling_goes_step_by_step_and_moves_nothing():
    bench = Bench()
    for axis in range(6):
        bench.plant.set_motor_counts(axis, 1000.0 * axis - 2000.0)
    start = [bench.plant.motor_counts(axis) for axis in range(6)]
    bench.arm.open()
    bench.network.sent.clear()
    bench.arm.enable()
    assert bench.words() == [0x00, 0x06, 0x07, 0x0F]
    assert bench.arm.state is ArmState.ENABLED
    bench.cycle(times=50)
    assert [bench.plant.motor_counts(axis) for axis in range(6)] == start


def test_request_out_of_order_is_refused_and_nothing_is_sent():
    bench = Bench()
    for request in (bench.arm.enable, bench.arm.cycle, bench.arm.disable, bench.arm.acknowledge):
        with pytest.raises(StateError, match="while it is new"):
            request()
    bench.arm.stop()
    assert bench.network.sent == []
    bench.arm.open()
    sent = len(bench.network.sent)
    bench.arm.disable()
    assert (len(bench.network.sent), bench.arm.state) == (sent, ArmState.CONFIGURED)


def test_joint_outside_its_limits_is_not_enabled():
    bench = Bench()
    bench.plant.set_motor_counts(2, 1.1 * SCALE)
    bench.arm.open()
    with pytest.raises(StateError, match="drive 3"):
        bench.arm.enable()
    assert bench.arm.state is ArmState.CONFIGURED
    bench.plant.set_motor_counts(2, 0.0)
    bench.arm.enable()


def test_cycles_that_come_sooner_than_a_period_make_shorter_steps():
    bench = Bench().enabled()
    begin_ns = bench.network.now_ns
    for _ in range(50):
        bench.arm.cycle((0.5,) * 6)
    took_s = (bench.network.now_ns - begin_ns) * 1e-9
    assert 0.0 < max(bench.arm.setpoint_rad) <= took_s + 1 / 140


@pytest.mark.parametrize("bad", [(nan,) * 6, (0.0,) * 5, (0.0,) * 7])
def test_setpoint_that_no_drive_may_get_is_refused_and_nothing_is_sent(bad):
    bench = Bench().enabled()
    sent = len(bench.network.sent)
    with pytest.raises(RefusedError):
        bench.arm.cycle(bad)
    assert len(bench.network.sent) == sent
    assert bench.arm.state is ArmState.ENABLED


def test_stop_slows_down_smoothly_and_holds():
    bench = Bench(quick_stop_rad_per_s2=5.0).enabled()
    for tick in range(1, 71):
        bench.cycle(0.5 * tick / 70)
    bench.arm.stop()
    assert bench.arm.state is ArmState.STOPPED
    path = [bench.cycle(0.5).position_rad[0] for _ in range(60)]
    steps = [b - a for a, b in itertools.pairwise(path)]
    assert all(0.0 <= step <= 1.05 / 140 for step in steps)
    assert all(after <= before + 2 / SCALE for before, after in itertools.pairwise(steps))
    # From 1 rad/s at 5 rad/s2: 0.1 rad further, after 0.2 s.
    assert path[-1] - path[0] == pytest.approx(0.1, abs=0.012)
    assert path[30:] == [path[-1]] * 30


def test_stop_works_when_the_bus_is_gone():
    bench = Bench().enabled()
    bench.network.broken = OSError(105, "No buffer space available")
    bench.arm.stop()
    bench.arm.stop()
    with pytest.raises(SilentError, match=r"does not take frames.*No buffer space"):
        bench.cycle()
    bench.arm.stop()
    bench.arm.close()
    assert bench.arm.state is ArmState.CLOSED


def test_interruption_stops_the_arm(monkeypatch):
    bench = Bench().enabled()
    send = bench.network.send_message

    def interrupted(can_id, data, remote=False):
        monkeypatch.undo()
        raise KeyboardInterrupt

    monkeypatch.setattr(bench.network, "send_message", interrupted)
    with pytest.raises(KeyboardInterrupt):
        bench.cycle(0.005)
    assert bench.network.send_message == send
    assert bench.arm.state is ArmState.STOPPED
    assert {drive.machine.state for drive in bench.drives} == {PowerState.QUICK_STOP}


def test_closing_takes_the_power_away_without_alarm():
    bench = Bench().enabled()
    bench.cycle(0.005, times=5)
    bench.arm.close()
    bench.arm.close()
    bench.network.sleep(1.0)
    assert {drive.machine.state for drive in bench.drives} == {PowerState.SWITCH_ON_DISABLED}
    assert [drive.objects[0x1001] for drive in bench.drives] == [0] * 6
    assert 0x181 not in bench.network.subscribers


def test_arm_that_does_not_come_to_rest_keeps_its_power_and_is_a_fault():
    bench = Bench().enabled()
    counts = itertools.count(step=100)

    def moving(frame):
        position = next(counts).to_bytes(4, "little")
        return [BusFrame(frame.arbitration_id, frame.data[:2] + position + frame.data[6:])]

    on_answers(bench.drives[1], moving)
    with pytest.raises(SilentError, match="joints do not come to rest; use the emergency stop"):
        bench.arm.disable()
    assert bench.arm.state is ArmState.FAULTED
    assert {drive.machine.state for drive in bench.drives} == {PowerState.QUICK_STOP}


def test_dead_drive_does_not_keep_the_others_under_power():
    bench = Bench().enabled()
    mute(bench.drives[2])
    bench.arm.close()
    alive = {drive.machine.state for drive in bench.drives if drive is not bench.drives[2]}
    assert alive == {PowerState.SWITCH_ON_DISABLED}


def test_arm_without_any_answer_is_over_in_time():
    bench = Bench().enabled()
    begin_ns = bench.network.now_ns
    for drive in bench.drives:
        mute(drive)
    with pytest.raises(SilentError):
        bench.cycle(0.003, times=40)
    bench.arm.stop()
    bench.arm.close()
    assert bench.network.now_ns - begin_ns < 2 * 10**9


def test_host_that_dies_leaves_an_arm_at_rest():
    bench = Bench().enabled()
    for tick in range(1, 30):
        bench.cycle(0.5 * tick / 140)
    bench.network.sleep(1.0)
    assert {drive.machine.state for drive in bench.drives} == {PowerState.QUICK_STOP}
    before = bench.plant.motor_counts(0)
    bench.network.sleep(1.0)
    assert bench.plant.motor_counts(0) == before


def test_drive_that_is_not_there_and_a_device_of_another_profile_are_named():
    bench = Bench()
    mute(bench.drives[3])
    with pytest.raises(WiringError, match="drive 4"):
        bench.arm.open()
    bench.drives[3].outgoing = list
    bench.drives[1].objects[0x1000] = 0x0001_0191
    with pytest.raises(WiringError, match="drive 2: is a device of profile 401"):
        bench.arm.open()
    bench.drives[1].objects[0x1000] = 0x0002_0192
    bench.arm.open()


@pytest.mark.parametrize(("index", "notes"), [(0x605A, 1), (0x6085, 1), (0x6007, 1), (0x1016, 1), (0x60C2, 0)])
def test_object_that_a_drive_may_lack_is_done_without_and_noted(index, notes):
    def without(bench):
        objects = bench.drives[1].objects
        objects.set_data = partial(_write_without, objects.set_data, index)
        return bench

    bench = without(Bench()).enabled()
    assert [note.partition(":")[0] for note in bench.arm.notes] == [f"drive 2 has no object 0x{index:04X}"] * notes
    bench.cycle(0.001, times=5)
    bench.arm.disable()


def _write_without(write, missing, index, sub, data, *, check_writable):
    if index == missing:
        raise SdoAbortedError(ABORT_NO_OBJECT)
    write(index, sub, data)


def obey_nothing(bench):
    bench.drives[1].machine.apply = lambda word: None


def put(bench, angle_rad):
    """The second joint is elsewhere all at once."""
    bench.plant.set_motor_counts(1, angle_rad * SCALE)
    bench.drives[1]._servo.engage()


def astray(bench):
    bench.drives[1].objects[0x6060] = 0
    put(bench, 1.1)


def jammed(bench):
    bench.plant.jam(1)
    bench.drives[1].objects[0x6065] = 10


def status(bit):
    def provoke(bench):
        bench.cycle(times=3)
        on_answers(bench.drives[1], flipped(bit))

    return provoke


def homing(bench):
    objects = bench.drives[1].objects
    objects._written = lambda index: objects.__setitem__(0x6061, 6)


def heartless(bench):
    bench.drives[1].outgoing = lambda frames: [frame for frame in frames if frame.arbitration_id != 0x702]


@pytest.mark.parametrize(
    ("provoke", "kind", "message"),
    [
        (heartless, SilentError, "not every drive became operational"),
        (lambda b: on_answers(b.drives[1], lost), SilentError, r"drives \[2\] send no process data"),
        (homing, DeviceFaultError, r"drive 2: does not take mode CSP \(8\); it shows b'\\x06'"),
    ],
)
def test_drive_that_cannot_be_set_up_is_named_and_none_has_power(provoke, kind, message):
    bench = Bench()
    provoke(bench)
    with pytest.raises(kind, match=message):
        bench.arm.open()
    assert bench.arm.state is ArmState.NEW
    assert {drive.machine.state for drive in bench.drives} == {PowerState.SWITCH_ON_DISABLED}


CASES = {
    "fault": (lambda b: b.drives[1]._fault(), DeviceFaultError, "drive 2: is in fault"),
    "EMCY": (
        lambda b: b.drives[1].emergency(0x4210, b"\x01\x02"),
        DeviceFaultError,
        "drive 2: reports EMCY 0x4210 .*0102000000",
    ),
    "following error": (jammed, DeviceFaultError, "drive 2: reports EMCY 0x8611"),
    "no heartbeat": (heartless, SilentError, "drive 2: no heartbeat"),
    "no answers": (lambda b: on_answers(b.drives[1], lost, 3), SilentError, "drive 2: 3 SYNCs in.*; .*end other work"),
    "restart": (lambda b: b.drives[1].reset(), DeviceFaultError, "drive 2: restarted"),
    "NMT stopped": (
        lambda b: setattr(b.drives[1], "nmt", NmtState.STOPPED),
        DeviceFaultError,
        "drive 2: is no longer operational",
    ),
    "power lost": (
        lambda b: setattr(b.drives[1].machine, "state", PowerState.NOT_READY),
        DeviceFaultError,
        "drive 2: went to 'not ready to switch on' by itself",
    ),
    "beyond its limits": (astray, DeviceFaultError, "drive 2: is at 1.1000 rad"),
    "status 9": (status(9), DeviceFaultError, r"drive 2: does not obey this bus \(remote, .*from local to remote"),
    "status 13": (status(13), DeviceFaultError, r"drive 2: has fallen behind its set-points \(following error"),
    "mode taken": (
        lambda b: b.drives[1].objects.set_data(0x6060, 0, b"\0"),
        DeviceFaultError,
        r"drive 2: is in mode 0, not in CSP \(another master",
    ),
    "host away": (lambda b: b.network.sleep(0.15), LateError, r"has not heard from this computer for \d+ ms"),
    "bus error": (
        lambda b: setattr(b.network.notifier, "exception", ValueError("non-hexadecimal number found")),
        SilentError,
        "receiving has ended .*non-hexadecimal",
    ),
}


@pytest.mark.parametrize(("provoke", "kind", "message"), CASES.values(), ids=CASES)
def test_fault_stops_the_arm_and_stays(provoke, kind, message):
    bench = Bench().enabled()
    bench.cycle(0.001)
    provoke(bench)
    with pytest.raises(kind, match=message):
        bench.cycle(0.003, times=40)
    assert bench.arm.state is ArmState.FAULTED
    assert bench.arm.fault is not None
    assert {d.machine.state for d in bench.drives if d is not bench.drives[1]} <= STATIONARY
    sent = len(bench.network.sent)
    for refused in (bench.arm.cycle, bench.arm.enable, bench.arm.disable):
        with pytest.raises(DeviceFaultError, match="latched"):
            refused()
    assert len(bench.network.sent) == sent
    bench.arm.close()


@pytest.mark.parametrize("case", ["fault", "EMCY", "restart", "no answers"])
def test_fault_that_a_person_clears_leaves_the_arm_without_power(case):
    bench = Bench().enabled()
    CASES[case][0](bench)
    with pytest.raises(DriverError):
        bench.cycle(times=40)
    bench.arm.acknowledge()
    assert (bench.arm.state, bench.arm.fault) == (ArmState.CONFIGURED, None)
    assert {drive.machine.state for drive in bench.drives} == {PowerState.SWITCH_ON_DISABLED}
    bench.cycle(times=10)
    assert {drive.machine.state for drive in bench.drives} == {PowerState.SWITCH_ON_DISABLED}
    bench.arm.enable()
    bench.cycle(0.001)
    assert bench.arm.setpoint_rad == (0.001,) * 6


def test_fault_that_does_not_go_away_stays_latched():
    bench = Bench().enabled()
    bench.drives[0].fail(0x3210)
    machine = bench.drives[0].machine
    machine.apply = lambda word: None
    with pytest.raises(DeviceFaultError):
        bench.cycle(times=3)
    with pytest.raises(DeviceFaultError, match="not every drive reached"):
        bench.arm.acknowledge()
    assert bench.arm.state is ArmState.FAULTED
    del machine.apply
    bench.arm.acknowledge()


def test_drive_that_needs_a_person_is_named_without_power_and_not_enabled():
    bench = Bench()
    bench.arm.open()
    assert bench.arm.diagnostics()["fault"] == ""
    put(bench, 1.1)
    assert bench.cycle().position_rad == (0.0, 1.1, 0.0, 0.0, 0.0, 0.0)
    assert bench.arm.diagnostics()["fault"] == "drive 2 is at 1.1000 rad, beyond the joint's limits"
    put(bench, 0.0)
    bench.drives[5]._fault()
    bench.cycle()
    assert bench.arm.diagnostics()["fault"].startswith("drive 6 is in fault; look its code up")
    with pytest.raises(DeviceFaultError, match="drive 6: is in fault"):
        bench.arm.enable()
    assert bench.arm.state is ArmState.FAULTED
    assert all(drive.machine.state in STATIONARY for drive in bench.drives)
    bench.arm.acknowledge()
    bench.arm.enable()


def test_single_lost_answer_is_no_fault():
    bench = Bench().enabled()
    for _ in range(5):
        on_answers(bench.drives[3], lost, 2)
        bench.cycle(0.001, times=3)
    assert bench.arm.state is ArmState.ENABLED


def test_drive_that_does_not_obey_a_stop_is_a_fault():
    bench = Bench().enabled()
    obey_nothing(bench)
    bench.arm.stop()
    with pytest.raises(DeviceFaultError, match="drive 2: went to 'operation enabled' by itself"):
        bench.cycle(times=10)
