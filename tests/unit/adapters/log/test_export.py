"""Finding logs, and logs as CSV: every bit of every number."""

import csv
import json
import math
import struct
import tomllib

import pytest

from palpate.adapters.config import RunConfig, overlay, scenario
from palpate.adapters.log import find_logs
from palpate.adapters.log.export_csv import export_csv
from palpate.adapters.log.records import CallEntry, DecisionEntry, EndRecord, EventEntry, LossEntry, ReinforcementEntry
from palpate.adapters.replay import WhatIf, replay_files
from palpate.core.errors import ConfigurationError, LogError
from palpate.core.ports.values import AppliedCommand, CommandReason, Validity, WrenchSample
from tests.unit.adapters.log.made_logs import PERIOD_NS, POSTURE, start, tick, write_log

AWKWARD = (0.1 + 0.2, -0.0, 5e-324, 1.7976931348623157e308, math.pi, 1 / 3)


def rows(path):
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def bits(value):
    return struct.pack("<d", value)


def test_every_number_reads_back_to_the_bit(tmp_path):
    wrench = WrenchSample(AWKWARD[:3], AWKWARD[3:], 2**62 + 1, 2**62 + 3, 2**53 + 1)
    first = tick(0, wrench=wrench, requested_rad=AWKWARD, applied=AppliedCommand(AWKWARD[::-1], CommandReason.STOPPED))
    out = tmp_path / "out"
    assert export_csv([write_log(tmp_path / "a.mcap", [first, tick(1)])], out) == [out]
    row = rows(out / "ticks.csv")[0]
    found = [row[f"wrench_{name}_{axis}"] for name in ("force_N", "torque_Nm") for axis in "xyz"]
    assert [bits(float(text)) for text in found] == [bits(v) for v in AWKWARD]
    assert [bits(float(row[f"requested_rad_{i}"])) for i in range(1, 7)] == [bits(v) for v in AWKWARD]
    assert [bits(float(row[f"applied_rad_{i}"])) for i in range(1, 7)] == [bits(v) for v in AWKWARD[::-1]]
    assert int(row["wrench_source_time_ns"]) == 2**62 + 1
    assert int(row["wrench_receive_time_ns"]) == 2**62 + 3
    assert int(row["wrench_sequence"]) == 2**53 + 1
    assert (row["wrench_validity"], row["wrench_kind"], row["wrench_frame"]) == ("valid", "raw", "sensor")
    assert row["reason"] == "arm is stopped"
    second = rows(out / "ticks.csv")[1]
    assert int(second["tick"]) == 1
    assert int(second["time_ns"]) == int(second["joints_source_time_ns"]) == PERIOD_NS
    assert float(second["joints_position_rad_2"]) == POSTURE[1] + 1e-4


def test_what_was_not_there_is_an_empty_cell(tmp_path):
    nan = WrenchSample((math.nan, math.inf, 0.0), (0.0, 0.0, 0.0), 0, 0, 0, Validity.INVALID)
    export_csv(
        [write_log(tmp_path / "a.mcap", [tick(0, wrench=nan), tick(1, wrench=None, requested_rad=None, applied=None)])],
        tmp_path / "out",
    )
    first, second = rows(tmp_path / "out" / "ticks.csv")
    assert math.isnan(float(first["wrench_force_N_x"]))
    assert float(first["wrench_force_N_y"]) == math.inf
    assert first["wrench_validity"] == "invalid"
    empty = {name for name, text in second.items() if text == ""}
    assert {"wrench_force_N_x", "wrench_sequence", "requested_rad_1", "applied_rad_6", "reason"} <= empty
    assert not empty & {"tick", "time_ns", "joints_position_rad_1", "joints_validity"}


def test_everything_else_of_a_trial(tmp_path):
    others = [
        DecisionEntry(
            tick=1, number=0, symbol="x+ y0", state='a "b", c', action="-x", source="learned", temperature=4.5
        ),
        DecisionEntry(tick=2, number=1, symbol="x+ y0", state="s", action="+y", source="learned"),
        ReinforcementEntry(tick=2, number=0, reinforcement=-1.25),
        EventEntry(tick=1, name="contact", detail="surface, at 1 mm\nor so"),
        CallEntry(tick=2, port="arm", call="send", requested_rad=POSTURE, error="DeviceError", text="gone"),
        LossEntry(tick=2, problem="queue full", text="slow", dropped_messages=3),
    ]
    end = EndRecord(tick=2, outcome="inserted", learner_json='{"q":[1]}', depth_m=math.nan)
    begin = start(generator_json='{"state":340282366920938463463374607431768211455}')
    path = write_log(tmp_path / "a.mcap", [tick(0), tick(1), tick(2)], others=others, end=end, begin=begin)
    out = tmp_path / "out"
    export_csv([path], out)
    first, second = rows(out / "decisions.csv")
    assert (first["state"], first["action"], first["temperature"]) == ('a "b", c', "-x", "4.5")
    assert (first["reinforcement"], first["reinforcement_tick"]) == ("-1.25", "2")
    assert (second["number"], second["reinforcement"], second["temperature"]) == ("1", "", "")
    assert rows(out / "events.csv") == [
        {"tick": "1", "name": "contact", "detail": "surface, at 1 mm\nor so", "counterfactual": "False"}
    ]
    (call,) = rows(out / "calls.csv")
    assert (call["port"], call["error"]) == ("arm", "DeviceError")
    assert "wrench" not in call
    assert float(call["requested_rad_2"]) == POSTURE[1]
    (loss,) = rows(out / "recorder.csv")
    assert loss["dropped_messages"] == "3"
    message = json.loads((out / "start.json").read_text())
    assert (message["log"], message["seed"], message["ready_rad"]) == (str(path), 7, list(POSTURE))
    assert message["generator"]["state"] == 2**128 - 1
    assert overlay(RunConfig(), tomllib.loads((out / "config.toml").read_text())) == scenario("paper")
    ended = json.loads((out / "end.json").read_text())
    assert (ended["outcome"], ended["learner"], ended["depth_m"]) == ("inserted", {"q": [1]}, None)


def test_files_folders_and_patterns_once_each(tmp_path):
    for name in ("b.mcap", "a.mcap", "deep/c.mcap", "notes.txt", "d.mcap.cut-short-1"):
        path = tmp_path / name
        path.parent.mkdir(exist_ok=True)
        path.write_bytes(b"")
    names = [str(tmp_path / "b.mcap"), str(tmp_path), str(tmp_path / "*.mcap")]
    assert [path.name for path in find_logs(names)] == ["b.mcap", "a.mcap", "c.mcap"]
    # What is named outright is taken, whatever it is called.
    assert len(find_logs([str(tmp_path / "notes.txt")])) == 1


def test_calls_that_are_none_are_refused(tmp_path):
    with pytest.raises(ConfigurationError, match="jobs must be a whole number from 1 to 1024"):
        next(replay_files([], WhatIf(), 0))
    with pytest.raises(LogError, match="nowhere: is not there"):
        find_logs([tmp_path / "nowhere"])
