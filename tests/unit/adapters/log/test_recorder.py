"""What a log holds, in which order, and what it says of what it does not hold."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from palpate.adapters.log import CallEntry, TickRecord, messages_in
from palpate.core.control_loop import UnfinishedTick
from palpate.core.errors import DeviceError, LogError
from palpate.core.ports.values import AppliedCommand, JointCommand, WrenchSample
from tests.support.memory_sink import MemorySink
from tests.unit.adapters.log.crafted import start_with
from tests.unit.adapters.log.recording_bench import Bench, TroubledSink, log_of, ticks_of


def test_a_tick_holds_what_passed_the_ports() -> None:
    bench = Bench.running(3)
    bench.end()
    record = list(bench.log().records())[2]
    now = bench.clock.now_ns()
    wrench, joints = bench.sensor.read(), bench.encoder.read()
    command = bench.command(2)
    assert record == TickRecord(2, now, now, wrench, joints, command, AppliedCommand(command))


def test_what_the_trial_starts_with_is_asked_when_the_task_has_begun() -> None:
    bench, asked = Bench(), []

    def start() -> Any:
        asked.append(8)
        return start_with(trial=8)

    bench.recorder.begin(Path("x"), {}, start)
    assert asked == []
    bench.recorder.begun(0, bench.report)
    bench.end()
    assert asked == [8]
    assert bench.log().start.trial == 8


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
def test_a_tick_that_fails_is_kept_as_far_as_it_came(
    calling: str, held: int, call: str | None, error: Exception
) -> None:
    bench = Bench.running(20)
    deadline_ns = bench.wait()
    command = JointCommand((0.1, -0.2, 0.3))
    parts: list[Any] = [deadline_ns + 3, bench.sensor.read(), bench.encoder.read(), command]
    parts[held:] = [None] * (4 - held)
    bench.recorder.failed(error, UnfinishedTick(calling, *parts))
    bench.recorder.stopped(None)
    bench.end()
    log = bench.log()
    assert list(log.records())[-1] == TickRecord(20, parts[0], deadline_ns, parts[1], parts[2])
    failed = CallEntry(tick=20, port=calling, call=call or "", error="DeviceError", text="cable: cut")
    if calling == "arm":
        failed = replace(failed, asked_rad=command.position_rad)
    stop = CallEntry(tick=20, port="arm", call="stop")
    assert log.calls[1:] == ([failed, stop] if call and isinstance(error, DeviceError) else [stop])


def test_an_arm_that_cannot_be_stopped_is_recorded() -> None:
    bench = Bench()
    bench.recorder.stopped(None)  # no log is open
    bench.begin()
    bench.recorder.stopped(ZeroDivisionError("nothing is known of the arm then"))
    bench.recorder.stopped(DeviceError("arm", "cable cut"))
    bench.end()
    assert bench.log().calls[1:] == [
        CallEntry(tick=-1, port="arm", call="stop", error="DeviceError", text="arm: cable cut")
    ]


def test_one_log_at_a_time() -> None:
    bench = Bench()
    bench.begin()
    with pytest.raises(LogError, match="still open"):
        bench.begin()
    bench.end()
    bench.end()
    bench.begin()
    bench.run(3)
    bench.end()
    assert len(bench.sink.logs) == 2  # type: ignore[attr-defined]
    assert ticks_of(bench.log()) == [0, 1, 2]


@pytest.mark.parametrize("resting", [False, True])
def test_the_outcome_is_the_last_message(resting: bool) -> None:
    bench = Bench.running(40)
    if resting:
        bench.wait()
    bench.end(outcome="inserted")
    log = bench.log()
    assert log.end is not None
    assert log.end.outcome == "inserted"
    assert ticks_of(log) == list(range(40 + resting))


def test_trouble_ends_the_trial_where_that_is_wanted() -> None:
    sink = TroubledSink()
    bench = Bench.running(20, sink, stop_on_trouble=True)
    sink.tells.append("x.mcap: cannot be written (No space left on device)")
    with pytest.raises(DeviceError, match=r"flight recorder: x\.mcap: cannot be written"):
        bench.run(100)
    assert bench.tick < 40
    bench.recorder.stopped(None)
    bench.end(error="DeviceError")
    log = log_of(sink.logs[0])
    assert ticks_of(log) == list(range(bench.tick + 1))
    assert log.end is not None
    assert log.end.error == "DeviceError"


def test_trouble_is_only_reported_where_that_is_wanted() -> None:
    sink = TroubledSink()
    bench = Bench(sink)
    bench.begin()
    sink.tells += ["one", "two"]
    bench.run(40)
    bench.end()
    assert bench.recorder.troubles == ["one", "two"]
    assert ticks_of(bench.log()) == list(range(40))


def test_a_value_that_no_log_can_hold_is_lost_and_the_trial_goes_on() -> None:
    bench = Bench.running(5)
    good, bench.sensor.read = bench.sensor.read, lambda: _with_sequence(bench, 2**64)  # type: ignore[method-assign]
    bench.run(3)
    bench.sensor.read = good  # type: ignore[method-assign]
    bench.run(20)
    bench.end(text="\udcff")
    log = bench.log()
    assert ticks_of(log) == [*range(5), *range(8, 28)]
    assert [(loss.tick, loss.problem, loss.dropped_messages) for loss in log.losses] == [
        (tick, "cannot be packed", 1) for tick in (5, 6, 7, 27)
    ]
    assert log.missing == ""
    assert log.end is None
    assert "a message on /tick at tick 5 cannot be packed" in bench.recorder.troubles[0]
    assert "a message on /end at tick 27 cannot be packed" in bench.recorder.troubles[3]


def _with_sequence(bench: Bench, sequence: int) -> WrenchSample:
    now = bench.clock.now_ns()
    return WrenchSample((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), now, now, sequence)


@pytest.mark.parametrize("call", ["ticks", "calls"])
def test_messages_are_handed_over_within_a_quarter_of_a_second(call: str) -> None:
    sink = CountingSink()
    bench = Bench(sink)
    bench.begin()
    for _ in range(120):
        bench.run(1) if call == "ticks" else bench.recorder.stopped(None)
    assert len(sink.batches) >= 120 // 35
    assert sink.batches[0] == 1  # what the trial starts with is on its way before anything can happen
    assert max(sink.batches) <= 35


class CountingSink(MemorySink):
    """Counts the messages of each batch."""

    def __init__(self) -> None:
        super().__init__()
        self.batches: list[int] = []

    def put(self, pack: Callable[[], bytes]) -> None:
        self.batches.append(len(messages_in(pack())))
        super().put(pack)
