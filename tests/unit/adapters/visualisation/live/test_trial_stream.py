"""What is shown of a trial is what its log holds."""

import numpy as np
import pytest

from palpate.adapters.log import read_log, series_of, sound_messages
from palpate.adapters.mujoco import DrawnCell
from palpate.adapters.visualisation.live.trial_stream import POSE_TICKS, TrialStream, values_of
from palpate.core.errors import LogError
from tests.golden.record import HERE as GOLDEN
from tests.unit.adapters.visualisation.live.kept_display import KeptDisplay


def shown(name: str) -> KeptDisplay:
    path, display = GOLDEN / f"{name}.mcap", KeptDisplay()
    stream = TrialStream(display)
    for message in sound_messages(str(path), path.read_bytes()):
        stream.take(message)
    stream.flush()
    return display


def test_wrench_tip_and_lateness_are_those_of_the_log() -> None:
    display, log = shown("irregular"), read_log(GOLDEN / "irregular.mcap")
    series = series_of(log)
    tare = next(event.tick for event in log.events if event.name == "tare")
    ours = np.array([row for _, row in display.rows["wrench"]])
    valid = series.wrench[~np.isnan(series.wrench[:, 0])]
    # Until the zero was found there is none to take off, live; a picture made afterwards knows better.
    np.testing.assert_array_equal(ours[tare + 1 :], valid[tare + 1 :])
    known = [(r.time_ns, r.deadline_ns) for r in log.records() if r.wrench is not None]
    late = [
        (time_ns - deadline_ns) * 1e-6
        for time_ns, deadline_ns in known
        if time_ns is not None and deadline_ns is not None
    ]
    assert [row[0] for _, row in display.rows["timing"]] == late
    assert max(late) > 1.0


def test_the_arm_stands_as_its_encoders_said() -> None:
    display, log = shown("train-paper"), read_log(GOLDEN / "train-paper.mcap")
    cell, tip = DrawnCell(log), series_of(log)
    assert len(display.poses) == -(-len(log.ticks) // POSE_TICKS)
    assert set(display.poses[0][1]) == {*(f"link_{n}" for n in range(1, 7)), "sensor", "peg", "peg_upper", "plate"}
    plate = display.poses[0][1]["plate"]
    np.testing.assert_allclose(plate.position_m, cell.mouth_m)
    # In free air the gripper's springs are not bent, and the encoders know where the tip is.
    first = np.array(display.rows["tip"][0][1])
    np.testing.assert_allclose(first, tip.tip_mm[0], atol=1e-6)
    assert display.poses[0][2] is None
    begin, arrow = display.poses[-1][2] or ((0.0,) * 3, (0.0,) * 3)
    end = cell.goal_in_base.inverse().act(np.add(begin, arrow)) * 1e3
    np.testing.assert_allclose(end, display.rows["tip"][-1][1], atol=1e-9)
    shapes = display.scenes[0]
    assert {shape.kind for shape in shapes["plate"]} == {"box"}
    assert [shape.kind for shape in shapes["peg"]] == ["cylinder"]


def test_decisions_come_with_what_the_actions_were_worth() -> None:
    display, log = shown("train-paper"), read_log(GOLDEN / "train-paper.mcap")
    assert [entry for entry, _ in display.decisions] == log.decisions
    values = values_of(log.start)
    assert [worth for _, worth in display.decisions] == [values[entry.state] for entry in log.decisions]
    assert any(any(worth.values()) for _, worth in display.decisions)
    assert len(display.decisions[0][1]) == 8
    frozen = read_log(GOLDEN / "frozen-policy.mcap").start
    assert any(any(worth.values()) for worth in values_of(frozen).values())


def test_trips_and_failures_are_told() -> None:
    tripped = shown("fault-dead")
    assert tripped.states[0] == "passes the command"
    assert tripped.states[-1] == "latched"
    gone = shown("force-sensor-gone")
    assert gone.events[-1][1]
    assert gone.curve.trials == []
    whole = shown("train-sarsa")
    assert (whole.curve.trials, whole.curve.successes) == ([1], [1.0])


def test_a_message_without_a_trial_is_refused() -> None:
    path = GOLDEN / "train-paper.mcap"
    first, second, *_ = sound_messages(str(path), path.read_bytes())
    with pytest.raises(LogError, match="no trial has begun"):
        TrialStream(KeptDisplay()).take(second)
    with pytest.raises(LogError, match="cannot be shown"):
        TrialStream(KeptDisplay()).take(first._replace(payload=b"\x01\x02"))
