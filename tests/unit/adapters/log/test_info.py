"""What a log tells about itself."""

import math
from dataclasses import replace

import pytest

from palpate.adapters.log import CallEntry, EndRecord, EventEntry, LossEntry, describe, finite, info_of, read_log, table
from palpate.core.errors import LogError
from palpate.core.ports.values import AppliedCommand, CommandReason, JointSample, Validity, WrenchSample
from tests.unit.adapters.log.made_logs import PERIOD_NS, POSTURE, start, tick, write_log

MS = 1_000_000


def info(path, *words, **more):
    return info_of(read_log(write_log(path / "a.mcap", *words, **more)))  # type: ignore[arg-type]


def test_page_of_a_whole_trial(tmp_path):
    end = EndRecord(tick=140, outcome="inserted", ticks=141, success=True, exploration_time_s=0.5, depth_m=0.01)
    found = info(tmp_path, [tick(k) for k in range(141)], end=end)
    assert found.what["arm"] == "zebra-zero"
    assert (found.what["scenario"], found.what["seed"], found.what["trial"]) == ("paper", 7, 3)
    assert found.versions == {"palpate": "0.1.0"}
    assert (found.messages["/tick"], found.messages["/end"], found.messages["/call"]) == (141, 1, 0)
    assert found.ticks.duration_s == pytest.approx(140 * PERIOD_NS * 1e-9)
    assert found.ticks.rate_Hz == pytest.approx(140.0, abs=1e-4)
    assert (found.ticks.missing, found.ticks.late, found.ticks.incomplete) == (0, 0, 0)
    assert (found.force_sensor.new, found.force_sensor.repeats, found.force_sensor.unread) == (141, 0, 0)
    assert found.force_sensor.age.median_s == pytest.approx(0.002)
    assert found.joint_encoder.age.max_s == 0.0
    assert found.bytes_per_minute == pytest.approx(found.size_bytes / found.ticks.duration_s * 60)
    assert found.end is not None
    assert found.end["success"] is True
    assert found.trip is None
    page = describe(found)
    assert "inserted; exploration 0.500 s" in page
    assert "all applied as asked" in page
    assert "missing ticks  none" in page


def test_missing_ticks_are_counted_and_do_not_lower_the_rate(tmp_path):
    numbers = [*range(2, 50), *range(60, 101)]
    found = info(tmp_path, [tick(k) for k in numbers], end=EndRecord(tick=104, ticks=105))
    assert found.ticks.gaps == ((0, 1), (50, 59), (101, 104))
    assert found.ticks.missing == 16
    assert found.ticks.rate_Hz == pytest.approx(140.0, abs=1e-4)
    assert found.ticks.interval.max_s == pytest.approx(PERIOD_NS * 1e-9)
    assert "16: 0 to 1, 50 to 59, 101 to 104" in describe(found)


def test_log_that_is_cut_short_lacks_no_tick_that_anyone_knows_of(tmp_path):
    found = info(tmp_path, [tick(k) for k in range(5)])
    assert found.ticks.missing == 0
    assert found.end is None
    assert "the log ends before the trial did" in describe(found)


def test_late_ticks_are_counted(tmp_path):
    late = tick(3, time_ns=3 * PERIOD_NS + 2 * MS)
    nearly = tick(5, time_ns=5 * PERIOD_NS + MS)
    found = info(tmp_path, [tick(0), tick(1), tick(2), late, tick(4), nearly])
    assert found.ticks.late == 1
    assert found.ticks.lateness.max_s == pytest.approx(0.002)
    assert found.ticks.interval.max_s == pytest.approx(PERIOD_NS * 1e-9 + 0.002)


def test_sensor_slower_than_the_loop_gives_repeats(tmp_path):
    def held(k):
        old = k // 2 * 2
        return WrenchSample((0, 0, 0), (0, 0, 0), old * PERIOD_NS - MS, k * PERIOD_NS, old)

    found = info(tmp_path, [tick(k, wrench=held(k)) for k in range(10)]).force_sensor
    assert (found.samples, found.new, found.repeats) == (10, 5, 5)
    assert found.rate_Hz == pytest.approx(70.0, abs=1e-4)
    assert found.device_rate_Hz == pytest.approx(140.0, abs=1e-4)
    # Its sequence numbers go 0, 2, 4, ...: one of the device's samples between two readings was never read.
    assert found.unread == 4
    assert found.age.min_s == pytest.approx(0.001)
    assert found.age.max_s == pytest.approx(0.001 + PERIOD_NS * 1e-9)
    assert found.delivery.max_s == pytest.approx(0.001 + PERIOD_NS * 1e-9)


def test_samples_are_counted_by_validity(tmp_path):
    def marked(k, validity):
        return replace(tick(k).wrench, validity=validity)  # type: ignore[type-var]

    nan = JointSample((math.nan,) * 6, 0, 0, 9, Validity.INVALID)
    ticks = [tick(0), tick(1, wrench=marked(1, Validity.SATURATED)), tick(2, wrench=marked(2, Validity.STALE))]
    found = info(tmp_path, [*ticks, tick(3, joints=nan)])
    assert found.force_sensor.not_valid == {"saturated": 1, "stale": 1}
    assert found.joint_encoder.not_valid == {"invalid": 1}
    assert "force sensor: 1 saturated, 1 stale; encoders: 1 invalid" in describe(found)


def test_altered_commands_are_counted(tmp_path):
    limited = AppliedCommand(POSTURE, CommandReason.VELOCITY_LIMIT)
    stopped = AppliedCommand(POSTURE, CommandReason.STOPPED)
    ticks = [tick(0), tick(1, applied=limited), tick(2, applied=limited), tick(3, applied=stopped)]
    found = info(tmp_path, ticks)
    assert found.altered_commands == {"arm is stopped": 1, "joint velocity limit": 2}
    assert "2 joint velocity limit" in describe(found)


def test_incomplete_ticks_are_counted(tmp_path):
    found = info(tmp_path, [tick(0), tick(1, applied=None, asked_rad=None), tick(2, time_ns=None, wrench=None)])
    assert found.ticks.incomplete == 2
    assert (found.force_sensor.samples, found.joint_encoder.samples) == (2, 3)
    assert found.ticks.duration_s == pytest.approx(PERIOD_NS * 1e-9)


def test_errors_stops_and_losses_are_listed(tmp_path):
    others = [
        CallEntry(tick=1, port="force_sensor", call="read", error="DeviceError", text="cable\nout"),
        CallEntry(tick=1, port="arm", call="stop"),
        LossEntry(tick=1, problem="queue full", text="slow", dropped_messages=14),
        LossEntry(tick=1, problem="queue full", text="slow", dropped_messages=3),
    ]
    end = EndRecord(tick=1, ticks=2, error="DeviceError", text="cable out")
    found = info(tmp_path, [tick(0), tick(1)], others=others, end=end)
    assert found.errors == ("tick 1: force_sensor.read: DeviceError: cable\nout",)
    assert (found.stops, found.dropped_messages, len(found.losses)) == (1, 17, 2)
    page = describe(found)
    assert "17 messages dropped" in page
    assert "DeviceError: cable out" in page
    assert "ended by DeviceError" in page


def test_log_without_any_tick_has_no_rates(tmp_path):
    found = info(tmp_path, [], end=EndRecord(tick=-1, error="DeviceError", text="no arm"))
    assert (found.ticks.count, found.ticks.duration_s, found.ticks.rate_Hz) == (0, 0.0, None)
    assert found.bytes_per_minute is None
    assert found.force_sensor.rate_Hz is None
    assert "unknown" in describe(found)
    assert len(table([found]).splitlines()) == 2


def test_what_if_is_said_to_be_one(tmp_path):
    found = info(tmp_path, [tick(0), tick(1, counterfactual=True)], begin=start(derived_from="x.mcap"))
    assert found.what["what_if"] is True
    assert found.ticks.counterfactual == 1
    assert "a what-if and no observation" in describe(found)
    assert "x.mcap" in describe(found)


@pytest.mark.parametrize(
    ("changes", "where"),
    [({"versions_json": "{"}, "start.versions_json"), ({"versions_json": "[]"}, "start.versions_json"),
     ({"config_toml": "a = ["}, "start.config_toml")],
)  # fmt: skip
def test_malformed_text_is_refused(tmp_path, changes, where):
    with pytest.raises(LogError, match=where):
        info(tmp_path, [tick(0)], begin=start(**changes))


def test_number_that_json_does_not_know_is_null():
    assert finite({"a": [math.nan, 1.0, (math.inf,)], "b": "nan"}) == {"a": [None, 1.0, [None]], "b": "nan"}


@pytest.mark.parametrize(
    ("outcome", "events", "reason", "text"),
    [
        ("safety trip", ["trip", "end"], "PLATE_NOT_FELT", "nothing felt down to 2.93 mm"),
        # One that no supervisor noticed.
        ("sensor fault", ["end"], "sensor fault", "force sample stale, joint sample valid"),
    ],
)
def test_trip_or_sensor_fault_is_shown_with_its_reason(tmp_path, outcome, events, reason, text):
    entries = [EventEntry(tick=4, name=name, detail=f"{reason}: {text}") for name in events]
    found = info(tmp_path, [tick(k) for k in range(10)], others=entries, end=EndRecord(tick=9, outcome=outcome))
    assert found.trip == {"tick": 4, "reason": reason, "text": text}
    assert f"trip           {reason}: {text} (tick 4)" in describe(found)
