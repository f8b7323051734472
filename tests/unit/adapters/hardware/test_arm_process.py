"""The arm's process, here a thread: set-point time-out, latch, both ways of dying, lines that go dead. Virtual time."""

import json
import mmap
import threading

import pytest

from palpate.adapters.contracts import TICK_NS
from palpate.adapters.hardware.adapter_arm import AdapterArm
from palpate.adapters.hardware.arm_client import ArmClient
from palpate.adapters.hardware.arm_memory import _SLOT_BYTES, _WORDS_BYTES, ArmMemory, Setpoint
from palpate.adapters.hardware.plugins import ArmAdapter, RigContext
from palpate.adapters.hardware.served_arm import DriverArm, OpenArm
from palpate.adapters.hardware.zebra_zero import ZebraTable
from palpate.core.errors import FaultLatchedError
from palpate.core.motion import arm_named
from palpate.core.ports import AppliedCommand, CommandLimiter, CommandReason, JointCommand, Life
from palpate.drivers.device import ArmDriver, Measured
from palpate.drivers.errors import SilentError
from tests.contracts import test_cia402, test_zebra
from tests.fake_devices import FakeArm, FakeJointEncoder
from tests.support.arm_thread import ArmThread, arm_in_thread
from tests.virtual_time import VirtualTime

MS = 1_000_000
TIMEOUT_NS = 100 * MS
LONG_NS = 3_600 * 10**9
END_S = 2.0
"""Time from the fault within which everything is over."""


class SlowDriver(ArmDriver):
    """Its stops take half a second, and it fails on demand."""

    def __init__(self, clock):
        self.clock, self.is_dead, self.hangs = clock, False, False
        self.stops = 0

    def open(self): ...
    def enable(self): ...
    def disable(self): ...
    def acknowledge(self): ...
    def close(self): ...

    def cycle(self, setpoint_rad=None, /):
        while self.hangs:
            self.clock.sleep(0.1)
        if self.is_dead:
            raise SilentError("drive 3", "is dead", "bury it")
        return Measured((0.0,), self.clock.now_ns())

    def stop(self):
        self.stops += 1
        self.clock.sleep(0.5)


class Desk:
    """The slow arm, active."""

    def __init__(self, divider=1):
        self.clock = VirtualTime()
        self.driver = SlowDriver(self.clock)
        self.closed = 0
        limiter = CommandLimiter((-1.0,), (1.0,), (1.0,), 140.0)
        table = ZebraTable(divider=divider)
        arm = DriverArm("slow arm", lambda: OpenArm(self.driver, self.close), self.clock, limiter, table)
        self.arm = arm_in_thread(arm, self.clock, LONG_NS)
        self.arm.configure()
        self.arm.activate()

    def close(self):
        self.closed += 1


class Fakes:
    """A stranger's fake arm, active."""

    def __init__(self):
        self.clock = VirtualTime()
        self.servos = FakeArm(self.clock, (0.0,), lower_rad=(-1.0,), upper_rad=(1.0,), max_step_rad=0.1)
        self.encoder = FakeJointEncoder(self.clock, self.servos.position_rad)
        self.started = []
        context = RigContext(self.clock, arm_named("zebra-zero"), (-1.0,), (1.0,), (1.0,))
        self.served = AdapterArm(ArmAdapter(self.encoder, self.servos), context)
        self.arm = ArmClient(self.served, self.start, self.clock, TIMEOUT_NS)
        self.arm.configure()
        self.arm.activate()

    def start(self):
        self.started.append(ArmThread(self.served, self.clock, TIMEOUT_NS))
        return self.started[-1]

    def send(self, angle=0.05, *more):
        return self.arm.send(JointCommand((angle, *more))).reason

    def pass_ms(self, ms):
        self.clock.sleep(ms * 1e-3)


@pytest.fixture
def desk():
    made = Desk()
    yield made
    made.driver.hangs = False
    made.arm.close()
    gone(made.clock)


@pytest.fixture
def fakes():
    made = Fakes()
    yield made
    made.arm.close()
    gone(made.clock)


def gone(clock):
    """Let time go on until no arm's thread is left."""
    for thread in threading.enumerate():
        if thread.name.endswith(" bus"):
            clock.wait_for(lambda thread=thread: not thread.is_alive(), clock.now_ns() + 10**10)
            assert not thread.is_alive()


def seconds_since(clock, begin_ns):
    return (clock.now_ns() - begin_ns) * 1e-9


def zebra():
    bench = test_zebra.Bench(TIMEOUT_NS)
    return bench, bench.plant.joints_rad


def cia402():
    bench = test_cia402.Bench(TIMEOUT_NS)
    return bench, bench.motors.targets_rad


@pytest.mark.parametrize("make", [zebra, cia402])
def test_an_arm_on_a_bus_goes_on_no_longer_than_its_loop_and_only_a_person_sets_it_free(make):
    bench, where = make()
    with bench.desk, bench.arm as arm:
        begin_rad = where()
        angles = list(arm.read().position_rad)
        # By a loop that holds nothing back: far, and never again.
        angles[0] += 0.19
        arm._limiter.limited = lambda requested, now_ns: AppliedCommand(requested)
        arm.send(JointCommand(tuple(angles)))
        last_ns = bench.clock.now_ns()
        bench.clock.sleep(0.08)
        before_rad = where()
        bench.clock.sleep(0.015)
        assert begin_rad != before_rad != where()
        assert arm.life is Life.ACTIVE
        bench.clock.sleep(0.05)
        rest_rad = where()
        assert bench.clock.now_ns() - last_ns <= TIMEOUT_NS + 50 * MS
        bench.clock.sleep(0.3)
        assert where() == pytest.approx(rest_rad, abs=1e-3)
        assert arm.life is Life.FAULTED
        assert str(arm.fault).startswith("set-point time-out: no set-point for 10")
        for request in (lambda: arm.send(JointCommand(tuple(angles))), arm.activate):
            with pytest.raises(FaultLatchedError, match="set-point time-out: no set-point"):
                request()
        arm.acknowledge_fault()
        arm.activate()
        assert arm.send(JointCommand(tuple(angles))).reason is not CommandReason.STOPPED


def test_a_loop_that_keeps_sending_or_has_stopped_the_arm_need_not_fear_the_time_out(fakes):
    for _ in range(30):
        assert fakes.send() is CommandReason.AS_REQUESTED
        fakes.clock.sleep_until(fakes.clock.now_ns() + TICK_NS)
    fakes.arm.stop()
    assert fakes.send() is CommandReason.STOPPED
    fakes.pass_ms(500)
    assert fakes.arm.life is Life.ACTIVE


def test_a_loop_that_is_gone_leaves_an_arm_at_rest_and_nobody_behind(fakes):
    fakes.send(0.1)
    fakes.started[0].line.close()
    fakes.pass_ms(1)
    rest_rad = fakes.servos.position_rad()
    fakes.pass_ms(1000)
    assert (fakes.servos.position_rad(), fakes.servos.life) == (rest_rad, Life.CLOSED)
    assert not fakes.started[0].is_alive()


def test_a_process_that_dies_is_a_fault_at_once_and_acknowledging_it_starts_another(fakes):
    fakes.send()
    fakes.started[0].loop._closed = True
    fakes.pass_ms(2)
    with pytest.raises(FaultLatchedError, match=r"fake arm: .*arm's process has ended; only the drives"):
        fakes.send()
    fakes.arm.stop()
    fakes.servos.__init__(  # the device, as a new process finds it
        fakes.clock, (0.0,), lower_rad=(-1.0,), upper_rad=(1.0,), max_step_rad=0.1
    )
    fakes.encoder.__init__(fakes.clock, fakes.servos.position_rad)
    fakes.arm.acknowledge_fault()
    fakes.arm.activate()
    assert (fakes.send(), len(fakes.started)) == (CommandReason.AS_REQUESTED, 2)


def test_a_process_that_hangs_keeps_nobody_waiting_and_is_a_fault(fakes, monkeypatch):
    assert fakes.send(0.05) is CommandReason.AS_REQUESTED
    fakes.pass_ms(5)
    monkeypatch.setattr(fakes.servos, "send", lambda _: fakes.pass_ms(1500))
    begin_ns = fakes.clock.now_ns()
    held = fakes.arm.send(JointCommand((0.09,)))
    assert (held.position_rad, held.reason) == ((0.05,), CommandReason.VELOCITY_LIMIT)
    assert fakes.clock.now_ns() - begin_ns <= 3 * MS
    fakes.pass_ms(510)
    with pytest.raises(FaultLatchedError, match=r"process has not run for 5.. ms"):
        fakes.arm.read()
    # Nobody waits for it any more, and it finds its line closed once it goes on.
    begin_ns = fakes.clock.now_ns()
    fakes.arm.stop()
    assert fakes.clock.now_ns() == begin_ns
    fakes.pass_ms(3000)
    assert (fakes.started[0].is_alive(), fakes.servos.life) == (False, Life.CLOSED)


def test_what_waited_while_its_process_stood_still_is_not_made_up_for(fakes, monkeypatch):
    sent = []
    send = fakes.servos.send

    def noted(command):
        sent.append(command.position_rad[0])
        fakes.clock.sleep(0.03)
        return send(command)

    monkeypatch.setattr(fakes.servos, "send", noted)
    for angle in (0.01, 0.02, 0.03, 0.04):
        fakes.send(angle)
    fakes.pass_ms(80)
    assert sent == [0.01, 0.04]


def test_a_dead_arm_is_told_once_whoever_asks_and_soon_over(desk):
    begin_ns = desk.clock.now_ns()
    desk.driver.is_dead = True
    # A key, named so that virtual time waits for it, and the loop.
    second = threading.Thread(target=desk.arm.stop, name="operator on the bus")
    second.start()
    desk.arm.stop()
    desk.arm.stop()
    assert desk.arm.fault == "drive 3: is dead; bury it"
    desk.arm.close()
    gone(desk.clock)
    assert desk.driver.stops == 1
    assert seconds_since(desk.clock, begin_ns) < 0.7


def test_a_driver_that_hangs_keeps_nobody_waiting(desk):
    desk.driver.hangs = True
    desk.clock.sleep(0.05)
    begin_ns = desk.clock.now_ns()
    desk.arm.stop()
    assert seconds_since(desk.clock, begin_ns) < END_S
    assert desk.driver.stops == 0


def test_a_stop_does_not_wait_for_the_next_cycle():
    desk = Desk(divider=14)
    desk.clock.sleep(0.01)
    begin_ns = desk.clock.now_ns()
    desk.arm.stop()
    # The driver's own half second, and no tenth of one before it.
    assert (desk.driver.stops, seconds_since(desk.clock, begin_ns) < 0.51) == (1, True)
    desk.arm.close()
    gone(desk.clock)


def test_what_is_kept_of_an_arm_is_where_it_came_to_rest_and_not_where_it_swung(tmp_path):
    counts = tmp_path / "counts.json"
    bench = test_zebra.Bench(counts_file=str(counts))
    with bench.desk:
        bench.arm.configure()
        bench.arm.activate()
        bench.arm.stop()
        swinging = json.loads(counts.read_text())
        bench.plant.jam(0)
        bench.plant.push(0, 50.0)
        bench.advance(5)
        bench.arm.close()
    assert json.loads(counts.read_text()) == [swinging[0] + 50, *swinging[1:]]


def test_the_newest_whole_note_counts():
    memory = mmap.mmap(-1, ArmMemory.BYTES)
    writer, reader = ArmMemory(memory), ArmMemory(memory)
    assert reader.setpoint.read() is None
    for number in range(1, 6):
        writer.setpoint.write(Setpoint(number, 0, (0.1 * number,)))
    found = reader.setpoint.read()
    assert found.number == 5
    writer.setpoint.write(Setpoint(6, 0, (0.6,)))
    # As if its writer had been killed in the middle.
    for slot in (0, _SLOT_BYTES):
        memory[_WORDS_BYTES + slot + 20] ^= 1
    assert reader.setpoint.read() is found
    assert reader.status.read().joints is None
    writer.stop_requested_ns = 1 << 40
    assert (reader.stop_requested_ns, reader.stopped_ns, reader.heartbeat_ns) == (1 << 40, 0, 0)
