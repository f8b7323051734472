"""What a log holds, in which order, and what it says of what it does not hold."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from palpate.adapters.log.reader import first_tick_problem, sound_messages
from palpate.adapters.log.schema import BY_ID
from palpate.adapters.log.tick_layout import TickRecord
from palpate.adapters.log.writer_client import Opening
from palpate.core.errors import DeviceError, LogError
from palpate.core.insertion.trial import DecisionRecord, Event, TrialReport, TrialSetup
from palpate.core.ports.values import AppliedCommand, JointCommand, WrenchSample
from tests.unit.adapters.log.crafted import STARTING, start_with
from tests.unit.adapters.log.recording_bench import Bench, ChokingSink, log_of, ticks_of


def topics(data: bytes) -> list[str]:
    return [BY_ID[message.channel].topic for message in sound_messages("x", data)]


def test_a_trial_in_order() -> None:
    bench = Bench(start_ns=10**15)
    bench.begin()
    bench.run(30)
    bench.ports.arm.stop()
    bench.end(outcome="inserted")
    assert topics(bench.sink.logs[0]) == ["/start", "/call", *["/tick"] * 30, "/call", "/end"]  # type: ignore[attr-defined]
    log = bench.log()
    assert log.start == STARTING
    assert first_tick_problem(log) is None
    assert [(c.tick, c.port, c.call, c.time_ns) for c in log.calls] == [
        (-1, "clock", "now_ns", 10**15),
        (29, "arm", "stop", None),
    ]
    assert log.end is not None
    assert log.end.outcome == "inserted"


def test_a_tick_holds_what_passed_the_ports() -> None:
    bench = Bench()
    bench.begin()
    bench.run(3)
    bench.end()
    record = list(bench.log().records())[2]
    now = bench.clock.now_ns()
    wrench, joints = bench.sensor.read(), bench.encoder.read()
    command = bench.command(2)
    assert record == TickRecord(2, now, now, wrench, joints, command, AppliedCommand(command))


def test_messages_carry_the_time_of_the_run() -> None:
    bench = Bench(start_ns=10**9)
    bench.begin()
    bench.run(5)
    bench.end()
    times = [m.time_ns for m in sound_messages("x", bench.sink.logs[0])]  # type: ignore[attr-defined]
    assert times[0] == 10**9
    assert times == sorted(times)
    assert times[-1] == bench.clock.now_ns()


def test_what_the_trial_starts_with_is_asked_when_the_task_has_begun() -> None:
    bench, asked = Bench(), []

    def start() -> Any:
        asked.append(bench.recorder.tick)
        return start_with(trial=8)

    bench.recorder.begin(Opening(Path("x"), {}), bench.task, start)
    assert asked == []
    bench.ports.force_sensor.read()
    bench.ports.clock.now_ns()
    bench.end()
    assert asked == [-1]
    assert bench.log().start.trial == 8
    assert [call.port for call in bench.log().calls] == ["force_sensor", "clock"]


def test_a_trial_without_any_port_call_still_has_a_start_and_an_end() -> None:
    bench = Bench()
    bench.recorder.begin(Opening(Path("x"), {}), bench.task, lambda: STARTING)
    bench.end()
    assert topics(bench.sink.logs[0]) == ["/start", "/end"]  # type: ignore[attr-defined]


def test_further_reads_in_a_tick_are_calls_of_that_tick() -> None:
    bench = Bench()
    bench.begin()
    bench.run(2)
    p = bench.ports
    p.clock.sleep_until(bench.clock.now_ns() + 1000)
    p.force_sensor.read()
    p.clock.now_ns()
    p.force_sensor.read()
    p.joint_encoder.read()
    p.joint_encoder.read()
    p.clock.now_ns()
    p.arm.send(JointCommand((0.1, -0.2, 0.3)))
    p.arm.send(JointCommand((0.2, -0.2, 0.3)))
    p.joint_encoder.read()
    bench.end()
    log = bench.log()
    assert ticks_of(log) == [0, 1, 2]
    calls = [(call.tick, call.port, call.call) for call in log.calls[1:]]
    assert calls == [
        (2, "force_sensor", "read"),
        (2, "joint_encoder", "read"),
        (2, "clock", "now_ns"),
        (2, "arm", "send"),
        (2, "joint_encoder", "read"),
    ]
    assert log.calls[4].asked_rad == (0.2, -0.2, 0.3)
    assert log.calls[4].applied is not None
    assert log.calls[4].applied.position_rad[0] == pytest.approx(0.12001)


@pytest.mark.parametrize("missing", ["clock", "force_sensor", "joint_encoder", "send"])
def test_a_tick_in_which_something_did_not_happen(missing: str) -> None:
    bench = Bench()
    bench.begin()
    bench.run(1)
    p = bench.ports
    p.clock.sleep_until(bench.clock.now_ns() + 1000)
    if missing != "clock":
        p.clock.now_ns()
    if missing != "force_sensor":
        p.force_sensor.read()
    if missing != "joint_encoder":
        p.joint_encoder.read()
    if missing != "send":
        p.arm.send(JointCommand((0.1, -0.2, 0.3)))
    bench.tick += 1
    bench.run(1)
    bench.end()
    log = bench.log()
    assert ticks_of(log) == [0, 1, 2]
    record = list(log.records())[1]
    absent = {"clock": "time_ns", "force_sensor": "wrench", "joint_encoder": "joints", "send": "asked_rad"}
    parts = ("time_ns", "wrench", "joints", "asked_rad")
    assert [name for name in parts if getattr(record, name) is None] == [absent[missing]]
    assert (record.applied is None) == (missing == "send")
    assert len(log.calls) == 1


def test_events_and_decisions_are_followed() -> None:
    bench = Bench()
    bench.begin()
    report = bench.task.report = TrialReport(TrialSetup(1, 0, (0.0, 0.0)), temperature=4.5)
    bench.run(2)
    report.events.append(Event(1, "contact", "5 N"))
    report.decisions.append(DecisionRecord(1, "x0", "s0", "+x", "learned"))
    bench.run(1)
    report.decisions[0] = DecisionRecord(1, "x0", "s0", "+x", "learned", -1.0)
    report.decisions.append(DecisionRecord(2, "x1", "s1", "-x", "learned"))
    bench.run(2)
    report.decisions[1] = DecisionRecord(2, "x1", "s1", "-x", "learned", -2.0)
    report.events.append(Event(4, "end"))
    bench.end()
    log = bench.log()
    assert [(e.tick, e.name, e.detail) for e in log.events] == [(1, "contact", "5 N"), (4, "end", "")]
    assert [(d.tick, d.number, d.action, d.temperature) for d in log.decisions] == [
        (1, 0, "+x", 4.5),
        (2, 1, "-x", 4.5),
    ]
    assert [(r.tick, r.number, r.reinforcement) for r in log.reinforcements] == [(3, 0, -1.0), (4, 1, -2.0)]


def test_the_report_of_the_trial_before_is_not_recorded_again() -> None:
    bench = Bench()
    bench.task.report.events.append(Event(9, "old"))
    bench.task.report.decisions.append(DecisionRecord(9, "x0", "s0", "+x", "learned", -1.0))
    bench.begin()
    bench.end()
    assert bench.log().events == []
    assert bench.log().decisions == []
    bench.begin()
    bench.task.report = TrialReport(TrialSetup(1, 0, (0.0, 0.0)), events=[Event(0, "new")])
    bench.run(1)
    bench.end()
    assert [event.name for event in bench.log().events] == ["new"]


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


def test_a_log_may_end_before_its_trial() -> None:
    bench = Bench()
    bench.begin()
    bench.run(20)
    bench.recorder.end(None)
    assert bench.log().end is None
    assert ticks_of(bench.log()) == list(range(20))


def test_equal_trials_give_equal_bytes() -> None:
    logs = []
    for _ in range(2):
        bench = Bench()
        bench.begin()
        bench.run(100)
        bench.end()
        logs.append(bench.sink.logs[0])  # type: ignore[attr-defined]
    assert logs[0] == logs[1]


@pytest.mark.parametrize(("from_tick", "to_tick"), [(14, 42), (0, 28), (20, 21), (20, 60)])
def test_what_is_dropped_is_counted_and_marked(from_tick: int, to_tick: int) -> None:
    sink = ChokingSink()
    bench = Bench(sink)
    bench.begin()
    bench.run(from_tick)
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
    bench = Bench(sink)
    bench.begin()
    bench.run(50)
    sink.full = True
    bench.run(50)
    bench.end()
    (mark,) = bench.log().losses
    assert mark.last_dropped_tick == max(set(range(100)) - set(ticks_of(bench.log())))


def test_what_the_trial_starts_with_is_never_dropped() -> None:
    sink = ChokingSink()
    sink.full = True
    bench = Bench(sink)
    bench.begin()
    bench.run(40)
    bench.end()
    assert bench.log().start == STARTING
    assert bench.log().losses[0].dropped_messages == len([m for m in sink.lost if m[0] != 7])


@pytest.mark.parametrize("ticks", range(40, 54))
@pytest.mark.parametrize("resting", [False, True])
def test_what_the_trial_came_to_is_never_dropped(ticks: int, resting: bool) -> None:
    sink = ChokingSink()
    bench = Bench(sink)
    bench.begin()
    bench.run(ticks)
    sink.full = True
    if resting:
        bench.ports.clock.sleep_until(10**12)
    bench.end(outcome="inserted")
    log = bench.log()
    assert log.end is not None
    assert log.end.outcome == "inserted"
    assert ticks_of(log) == list(range(ticks + resting))
    assert (log.losses, sink.lost) == ([], [])


def test_trouble_ends_the_trial_where_that_is_wanted() -> None:
    sink = ChokingSink()
    bench = Bench(sink, stop_on_trouble=True)
    bench.begin()
    bench.run(20)
    sink.tells.append("x.mcap: cannot be written (No space left on device)")
    with pytest.raises(DeviceError, match=r"flight recorder: x\.mcap: cannot be written"):
        bench.run(100)
    assert bench.tick < 40
    bench.ports.arm.stop()
    bench.end(error="DeviceError")
    log = log_of(sink.logs[0])
    assert ticks_of(log) == list(range(bench.tick + 1))
    assert log.end is not None
    assert log.end.error == "DeviceError"


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
    bench = Bench()
    bench.begin()
    bench.run(5)
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


def test_ticks_that_never_come_to_a_command_are_handed_over_too() -> None:
    bench = Bench()
    bench.begin()
    for k in range(60):
        bench.ports.clock.sleep_until(k * 7_000_000)
        assert len(bench.recorder._batch) <= 14
    bench.end()
    assert ticks_of(bench.log()) == list(range(60))


def test_calls_before_the_first_tick_are_handed_over_too() -> None:
    bench = Bench()
    bench.begin()
    for _ in range(60):
        bench.ports.joint_encoder.read()
        assert len(bench.recorder._batch) <= 14
    bench.end()
    assert len(bench.log().calls) == 61
