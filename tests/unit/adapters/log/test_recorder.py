"""What a log holds, in which order, and what it says of what it does not hold."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from palpate.adapters.log import CallEntry, Opening, TickRecord
from palpate.adapters.log.schema import BY_ID
from palpate.core.control_loop import UnfinishedTick
from palpate.core.errors import DeviceError, LogError
from palpate.core.ports.values import AppliedCommand, JointCommand, WrenchSample
from tests.unit.adapters.log.crafted import STARTING, start_with
from tests.unit.adapters.log.recording_bench import Bench, ChokingSink, log_of, ticks_of


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

    bench.recorder.begin(Opening(Path("x"), {}), start)
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


@pytest.mark.parametrize(("from_tick", "to_tick"), [(14, 42), (0, 28), (20, 21), (20, 60)])
def test_what_is_dropped_is_counted_and_marked(from_tick: int, to_tick: int) -> None:
    sink = ChokingSink()
    bench = Bench.running(from_tick, sink)
    sink.full = True
    bench.run(to_tick - from_tick)
    sink.full = False
    bench.run(100 - to_tick)
    bench.end()
    log = bench.log()
    there, lost = ticks_of(log), [m for m in sink.lost if BY_ID[m[0]].topic != "/recorder"]
    assert bench.recorder.dropped_messages == len(lost)
    if not lost:
        assert (log.losses, bench.recorder.troubles) == ([], [])
        return
    missing = sorted(set(range(100)) - set(there))
    (mark,) = log.losses
    assert mark.dropped_messages == len(lost)
    assert mark.problem == "queue full"
    assert mark.text == f"{len(lost)} messages are missing, from tick {mark.first_dropped_tick} to {missing[-1]}"
    assert (max(mark.first_dropped_tick or 0, 0), mark.last_dropped_tick) == (missing[0], missing[-1])
    assert mark.tick == mark.last_dropped_tick
    assert len(bench.recorder.troubles) == 1
    assert f"lost from tick {mark.first_dropped_tick} on" in bench.recorder.troubles[0]


def test_a_loss_at_the_very_end_is_marked_too() -> None:
    sink = ChokingSink()
    bench = Bench.running(50, sink)
    sink.full = True
    bench.run(50)
    bench.end()
    (mark,) = bench.log().losses
    assert mark.last_dropped_tick == max(set(range(100)) - set(ticks_of(bench.log())))


def test_what_the_trial_starts_with_is_never_dropped() -> None:
    sink = ChokingSink()
    sink.full = True
    bench = Bench.running(40, sink)
    bench.end()
    assert bench.log().start == STARTING
    assert bench.log().losses[0].dropped_messages == len([m for m in sink.lost if m[0] != 7])


@pytest.mark.parametrize("ticks", range(40, 54))
@pytest.mark.parametrize("resting", [False, True])
def test_what_the_trial_came_to_is_never_dropped(ticks: int, resting: bool) -> None:
    sink = ChokingSink()
    bench = Bench.running(ticks, sink)
    sink.full = True
    if resting:
        bench.wait()
    bench.end(outcome="inserted")
    log = bench.log()
    assert log.end is not None
    assert log.end.outcome == "inserted"
    assert ticks_of(log) == list(range(ticks + resting))
    assert (log.losses, sink.lost) == ([], [])


def test_trouble_ends_the_trial_where_that_is_wanted() -> None:
    sink = ChokingSink()
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


class DeadSink(ChokingSink):
    """Its writer was killed."""

    @property
    def gone(self) -> bool:
        return self.full


def test_a_writer_that_is_gone_ends_the_trial_in_any_case() -> None:
    sink = DeadSink()
    bench = Bench.running(20, sink)
    sink.full = True
    sink.tells.append("x.mcap: the log writer is gone (Broken pipe)")
    with pytest.raises(DeviceError, match="the log writer is gone"):
        bench.run(100)
    assert bench.tick < 40


def test_a_full_queue_ends_the_trial_where_that_is_wanted() -> None:
    sink = ChokingSink()
    bench = Bench(sink, stop_on_trouble=True)
    bench.begin()
    sink.full = True
    with pytest.raises(DeviceError, match="queue is full"):
        bench.run(100)
    bench.end()
    assert bench.log().losses[0].last_dropped_tick == bench.tick


def test_trouble_is_only_reported_where_that_is_wanted() -> None:
    sink = ChokingSink()
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
    assert [(m.dropped_messages, m.first_dropped_tick, m.last_dropped_tick) for m in log.losses] == [
        (3, 5, 7),
        (1, 27, 27),
    ]
    assert log.end is None
    assert "a message on /tick at tick 5 cannot be packed" in bench.recorder.troubles[0]
    assert "a message on /end at tick 27 cannot be packed" in bench.recorder.troubles[1]


def _with_sequence(bench: Bench, sequence: int) -> WrenchSample:
    now = bench.clock.now_ns()
    return WrenchSample((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), now, now, sequence)


def test_calls_before_the_first_tick_are_handed_over_too() -> None:
    bench = Bench()
    bench.begin()
    for _ in range(60):
        bench.recorder.stopped(None)
        assert len(bench.recorder._batch) <= 14
    bench.end()
    assert len(bench.log().calls) == 61
