"""What a log holds of a trial, in which order, and what it says of what it does not hold."""

from dataclasses import replace
from pathlib import Path

import pytest

from palpate.adapters.contracts import FakeClock
from palpate.adapters.log import CallEntry, EndRecord, TickRecord, raised_by
from palpate.adapters.log.container import read_messages
from palpate.adapters.log.reader import assemble
from palpate.adapters.log.recorder import FlightRecorder
from palpate.core.control_loop import UnfinishedTick, tick_time_ns
from palpate.core.errors import DeviceError
from palpate.core.ports import AppliedCommand, JointCommand, Snapshot, WrenchSample
from palpate.core.trial import TrialReport, TrialSetup
from tests.fake_devices import FakeArm, FakeForceSensor, FakeJointEncoder
from tests.support.memory_sink import MemorySink
from tests.unit.adapters.log.made_logs import STARTING

HOME_RAD = (0.1, -0.2, 0.3)


class Bench:
    """Fake ports, active, and the events of a loop over them."""

    def __init__(self, begin=lambda: STARTING, **more):
        self.sink = MemorySink()
        self.sink.open(Path(), {})
        self.recorder = FlightRecorder(self.sink, begin, **more)
        self.report = TrialReport(TrialSetup(0, 0, (0.0, 0.0)))
        self.clock = FakeClock(0)
        self.arm = FakeArm(self.clock, HOME_RAD, lower_rad=(-1.0,) * 3, upper_rad=(1.0,) * 3, max_step_rad=0.02)
        self.sensor = FakeForceSensor(self.clock)
        self.encoder = FakeJointEncoder(self.clock, self.arm.position_rad)
        for device in (self.sensor, self.encoder, self.arm):
            device.configure()
            device.activate()
        self.tick = 0

    @classmethod
    def running(cls, ticks, **more):
        """In the middle of a trial."""
        bench = cls(**more)
        bench.recorder.begun(0, bench.report)
        bench.run(ticks)
        return bench

    def run(self, ticks):
        """As the core's loop does."""
        for _ in range(ticks):
            self.clock.sleep_until(self.wait())
            self.sensor.load_N = (0.0, 0.0, -float(self.tick))
            snapshot = Snapshot(self.tick, self.clock.now_ns(), self.sensor.read(), self.encoder.read())
            command = JointCommand(self.command(self.tick))
            self.recorder.sent(snapshot, command, self.arm.send(command))
            self.tick += 1

    def wait(self):
        """The next tick comes; its deadline."""
        deadline_ns = tick_time_ns(0, self.tick)
        self.recorder.waited(self.tick, deadline_ns)
        return deadline_ns

    @staticmethod
    def command(tick):
        return (0.1 + 1e-5 * tick, -0.2, 0.3)

    def log(self, **facts):
        """The log of the trial, which ends."""
        self.recorder.end(EndRecord(tick=self.tick - 1, **facts))
        self.sink.close()
        return log_of(self.sink.logs[-1])


def log_of(data):
    return assemble("x.mcap", data, *read_messages("x.mcap", data))


def ticks_of(log):
    return [record.tick for record in log.records()]


def test_tick_holds_what_passed_the_ports_and_messages_are_numbered():
    bench = Bench.running(3)
    record = list(bench.log().records())[2]
    now, command = bench.clock.now_ns(), bench.command(2)
    assert record == TickRecord(
        2, now, now, bench.sensor.read(), bench.encoder.read(), command, AppliedCommand(command)
    )
    messages, _ = read_messages("x.mcap", bench.sink.logs[-1])
    assert [message.sequence for message in messages] == list(range(len(messages)))


@pytest.mark.parametrize(
    ("calling", "held", "call"),
    [
        ("", 0, None),  # the clock
        ("force_sensor", 1, "read"),
        ("joint_encoder", 2, "read"),
        ("", 3, None),  # the task
        ("arm", 4, "send"),
    ],
)
@pytest.mark.parametrize("error", [DeviceError("cable", "cut"), ZeroDivisionError("oops")])
def test_tick_that_fails_is_kept_as_far_as_it_came(calling, held, call, error):
    bench = Bench.running(20)
    deadline_ns = bench.wait()
    command = JointCommand((0.1, -0.2, 0.3))
    parts = [deadline_ns + 3, bench.sensor.read(), bench.encoder.read(), command]
    parts[held:] = [None] * (4 - held)
    bench.recorder.failed(error, UnfinishedTick(calling, *parts))
    bench.recorder.stopped(None)
    assert bench.recorder.failed_port == calling
    log = bench.log()
    assert list(log.records())[-1] == TickRecord(20, parts[0], deadline_ns, parts[1], parts[2])
    failed = CallEntry(tick=20, port=calling, call=call or "", error="DeviceError", text="cable: cut")
    if calling == "arm":
        failed = replace(failed, requested_rad=command.position_rad)
    stop = CallEntry(tick=20, port="arm", call="stop")
    assert log.calls[1:] == ([failed, stop] if call and isinstance(error, DeviceError) else [stop])


def test_arm_that_cannot_be_stopped_is_recorded():
    bench = Bench.running(0)
    bench.recorder.stopped(ZeroDivisionError("nothing is known of the arm then"))
    bench.recorder.stopped(DeviceError("arm", "cable cut"))
    failed = CallEntry(tick=-1, port="arm", call="stop", error="DeviceError", text="arm: cable cut")
    assert bench.log().calls[1:] == [failed]


@pytest.mark.parametrize("unfinished", [False, True])
def test_outcome_is_the_last_message(unfinished):
    bench = Bench.running(40)
    if unfinished:
        bench.wait()
    log = bench.log(outcome="inserted")
    assert log.end.outcome == "inserted"
    assert ticks_of(log) == list(range(40 + unfinished))


def test_trouble_ends_the_trial_only_where_that_is_configured():
    trouble = "x.mcap: cannot be written (No space left on device)"
    for stop in (True, False):
        bench = Bench.running(20, stop_on_loss=stop)
        bench.sink.losses.append(trouble)
        if stop:
            with pytest.raises(DeviceError, match=r"flight recorder: x\.mcap: cannot be written"):
                bench.run(1)
            bench.recorder.stopped(None)
        else:
            bench.run(1)
        assert ticks_of(bench.log()) == list(range(21))


def test_value_that_no_log_can_hold_is_lost_and_the_trial_goes_on():
    bench = Bench.running(5)
    good = bench.sensor.read
    bench.sensor.read = lambda: _with_sequence(bench, 2**64)
    bench.run(3)
    bench.sensor.read = good
    bench.run(20)
    log = bench.log(text="\udcff")
    assert ticks_of(log) == [*range(5), *range(8, 28)]
    assert [(loss.tick, loss.problem, loss.dropped_messages) for loss in log.losses] == [
        (tick, "cannot be packed", 1) for tick in (5, 6, 7, 27)
    ]
    assert (log.missing, log.end) == ("", None)
    assert "a message on /tick at tick 5 cannot be packed" in bench.sink.losses[0]
    assert "a message on /end at tick 27 cannot be packed" in bench.sink.losses[3]


def _with_sequence(bench, sequence):
    now = bench.clock.now_ns()
    return WrenchSample((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), now, now, sequence)


LOOP = "palpate.core.control_loop"


@pytest.mark.parametrize(
    ("modules", "by"),
    [
        (("palpate.adapters.x", LOOP), "core"),
        ((LOOP, "palpate.core.tasks.x", "numpy"), "core"),
        ((LOOP, "palpate.core.ports.x", "palpate.core.tasks.x"), "outside"),
        ((LOOP, "observer", "palpate.core.tasks.x"), "outside"),
        ((LOOP, "palpate.core.tasks.x", "palpate.adapters.signals"), "outside"),
        (("palpate.core.tasks.x",), "outside"),
    ],
)
def test_error_is_of_the_core_where_the_loop_called_only_the_core(modules, by):
    source, inner = "def step(): raise inner", DeviceError("arm", "gone")
    for name in reversed(modules):
        scope = {"__name__": name, "inner": inner}
        exec(source, scope)
        source, inner = "def step(): inner()", scope["step"]
    with pytest.raises(DeviceError) as caught:
        inner()
    assert raised_by(caught.value) == by
