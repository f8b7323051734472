"""What a log tells about itself, and the public score sheet: on golden logs, and on a motion with a known jerk."""

from dataclasses import astuple

import numpy as np
import pytest

from palpate.adapters.log import (
    CallEntry,
    EndRecord,
    EventEntry,
    LossEntry,
    describe,
    info_of,
    read_log,
    score_of,
    table,
)
from palpate.adapters.log.score import mean_jerk_m_s3
from palpate.core.errors import LogError
from palpate.core.ports.values import WrenchSample
from tests.golden.record import HERE
from tests.unit.adapters.log.made_logs import PERIOD_NS, start, tick, write_log

MS = 1_000_000


def info(path, *words, **more):
    return info_of(read_log(write_log(path / "a.mcap", *words, **more)))


def test_page_of_a_whole_trial(tmp_path):
    end = EndRecord(tick=140, outcome="inserted", ticks=141, success=True, exploration_time_s=0.5, depth_m=0.01)
    found = info(tmp_path, [tick(k) for k in range(141)], end=end)
    assert found["arm"] == "zebra-zero"
    assert (found["scenario"], found["seed"], found["trial"]) == ("paper", 7, 3)
    assert found["versions"] == {"palpate": "0.1.0"}
    assert (found["messages"]["/tick"], found["messages"]["/end"], found["messages"]["/call"]) == (141, 1, 0)
    assert found["ticks"]["duration_s"] == pytest.approx(140 * PERIOD_NS * 1e-9)
    assert found["ticks"]["rate_Hz"] == pytest.approx(140.0, abs=1e-4)
    assert (found["ticks"]["missing"], found["ticks"]["late"], found["ticks"]["incomplete"]) == (0, 0, 0)
    assert (found["force_sensor"]["samples"], found["force_sensor"]["repeats"]) == (141, 0)
    assert found["force_sensor"]["age_s"]["median"] == pytest.approx(0.002)
    assert found["joint_encoder"]["age_s"]["max"] == 0.0
    assert found["bytes_per_minute"] == pytest.approx(found["size_bytes"] / found["ticks"]["duration_s"] * 60)
    assert found["end"]["success"] is True
    assert found["trip"] is None
    page = describe(found)
    assert "inserted; exploration 0.500 s" in page
    assert "all applied as requested" in page
    assert "missing ticks  none" in page


def test_missing_ticks_are_counted_and_do_not_lower_the_rate(tmp_path):
    numbers = [*range(2, 50), *range(60, 101)]
    found = info(tmp_path, [tick(k) for k in numbers], end=EndRecord(tick=104, ticks=105))
    assert found["ticks"]["gaps"] == [(0, 1), (50, 59), (101, 104)]
    assert found["ticks"]["missing"] == 16
    assert found["ticks"]["rate_Hz"] == pytest.approx(140.0, abs=1e-4)
    assert found["ticks"]["interval_s"]["max"] == pytest.approx(PERIOD_NS * 1e-9)
    assert "16: 0 to 1, 50 to 59, 101 to 104" in describe(found)


def test_sensor_slower_than_the_loop_gives_repeats(tmp_path):
    def held(k):
        old = k // 2 * 2
        return WrenchSample((0, 0, 0), (0, 0, 0), old * PERIOD_NS - MS, k * PERIOD_NS, old)

    found = info(tmp_path, [tick(k, wrench=held(k)) for k in range(10)])["force_sensor"]
    assert (found["samples"], found["repeats"]) == (10, 5)
    assert found["rate_Hz"] == pytest.approx(70.0, abs=1e-4)
    assert found["age_s"]["min"] == pytest.approx(0.001)
    assert found["age_s"]["max"] == pytest.approx(0.001 + PERIOD_NS * 1e-9)


def test_errors_stops_and_losses_are_listed(tmp_path):
    others = [
        CallEntry(tick=1, port="force_sensor", call="read", error="DeviceError", text="cable\nout"),
        CallEntry(tick=1, port="arm", call="stop"),
        LossEntry(tick=1, problem="queue full", text="slow", dropped_messages=14),
        LossEntry(tick=1, problem="queue full", text="slow", dropped_messages=3),
    ]
    end = EndRecord(tick=1, ticks=2, error="DeviceError", text="cable out")
    found = info(tmp_path, [tick(0), tick(1)], others=others, end=end)
    assert found["errors"] == ["tick 1: force_sensor.read: DeviceError: cable\nout"]
    assert (found["stops"], found["dropped_messages"], len(found["losses"])) == (1, 17, 2)
    page = describe(found)
    assert "17 messages dropped" in page
    assert "DeviceError: cable out" in page
    assert "ended by DeviceError" in page


def test_log_without_any_tick_has_no_rates(tmp_path):
    found = info(tmp_path, [], end=EndRecord(tick=-1, error="DeviceError", text="no arm"))
    assert (found["ticks"]["count"], found["ticks"]["duration_s"], found["ticks"]["rate_Hz"]) == (0, 0.0, None)
    assert found["bytes_per_minute"] is None
    assert found["force_sensor"]["rate_Hz"] is None
    assert "unknown" in describe(found)
    assert len(table([found]).splitlines()) == 2


@pytest.mark.parametrize(
    ("changes", "where"),
    [({"versions_json": "{"}, "start.versions_json"), ({"versions_json": "[]"}, "start.versions_json"),
     ({"config_toml": "a = ["}, "start.config_toml")],
)  # fmt: skip
def test_malformed_text_is_refused(tmp_path, changes, where):
    with pytest.raises(LogError, match=where):
        info(tmp_path, [tick(0)], begin=start(**changes))


@pytest.mark.parametrize(
    ("outcome", "events", "reason", "text", "shown"),
    [
        ("safety trip", ["trip", "end"], "PLATE_NOT_FOUND", "no contact down to 2.93 mm", "safety trip"),
        # Task and supervisor noticed the fault in the same tick.
        ("sensor fault", ["trip", "end"], "SAMPLE_INVALID", "the force sample is stale", "safety trip"),
        # One that no supervisor noticed.
        ("sensor fault", ["end"], "sensor fault", "force sample stale, joint sample valid", "sensor fault"),
    ],
)
def test_trip_or_sensor_fault_is_shown_with_its_reason(tmp_path, outcome, events, reason, text, shown):
    entries = [EventEntry(tick=4, name=name, detail=f"{reason}: {text}") for name in events]
    found = info(tmp_path, [tick(k) for k in range(10)], others=entries, end=EndRecord(tick=9, outcome=outcome))
    assert found["trip"] == {"tick": 4, "reason": reason, "text": text}
    assert f"trip           {reason}: {text} (tick 4)" in describe(found)
    assert found["end"]["outcome"] == shown


def scored(name):
    return score_of(read_log(HERE / f"{name}.mcap"))


def test_insertion_has_75_points_and_nearly_all_others():
    trial = scored("corner-first")
    points = trial.score
    assert (points.valid, points.success, points.duration, points.force) == (1.0, 75.0, 12.0, 0.0)
    assert 0.0 < points.smoothness < 6.0
    assert 5.0 < points.efficiency < 6.0
    assert points.total == pytest.approx(sum(astuple(points)))
    assert trial.basis == "truth"


def test_wedged_peg_has_points_for_its_depth():
    log = read_log(HERE / "wedged.mcap")
    assert score_of(log).score.success == pytest.approx(38.0 + 12.0 * log.end.true_depth_m / 10e-3, abs=0.01)


def test_peg_next_to_the_hole_has_points_for_its_distance_and_none_far_from_it():
    assert 0.0 < scored("fault-inverted").score.success < 25.0
    assert scored("trip-and-hold").score.total == 1.0


@pytest.mark.parametrize("jerk_m_s3", [2.0, 40.0])
def test_jerk_is_that_of_the_motion_while_it_moves(jerk_m_s3):
    time_s = np.arange(280) / 140.0
    moving_s = np.maximum(time_s - 0.5, 0.0)
    tip_m = np.stack([jerk_m_s3 * moving_s**3 / 6.0, 0.0 * time_s, 0.0 * time_s], axis=1)
    # Encoders at half the rate of the loop.
    assert mean_jerk_m_s3(np.repeat(tip_m[::2], 2, axis=0), time_s) == pytest.approx(jerk_m_s3, rel=0.1)
