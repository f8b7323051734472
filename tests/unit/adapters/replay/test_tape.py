"""The ports over a recorded trial, call by call, and the objects that ran it."""

import json
from copy import copy
from dataclasses import replace
from pathlib import Path

import pytest

from palpate.adapters.config import overlay, to_toml
from palpate.adapters.log import CallEntry, LossEntry, StartRecord, TickRecord, TrialLog, config_of, encode, read_log
from palpate.adapters.replay.ports import ReplayArm, ReplayClock, ReplaySensor
from palpate.adapters.replay.rebuild import Changes, Rebuilder, changed_config, parse_setting
from palpate.adapters.replay.tape import Tape
from palpate.core.errors import ConfigurationError, DeviceError, LogError, PalpateError
from palpate.core.policy import PolicyDocument, ThirdPartyEntry
from palpate.core.ports.values import AppliedCommand, CommandReason, JointCommand, JointSample, WrenchSample

START = StartRecord(
    schema="palpate.log/4", command="test", config_toml="", arm="", model_sha256="", core_sha256="", seed=0, trial=0,
    start_m=(0.0, 0.0), ready_rad=(), tip_rotation=(), perception_json="", policy="",
)  # fmt: skip


def tick(number, *, requested=(0.5, 0.0), reason=CommandReason.AS_REQUESTED):
    applied = requested if reason is CommandReason.AS_REQUESTED else tuple(a / 2 for a in requested)
    time_ns = 10 * number
    return TickRecord(
        number,
        time_ns,
        time_ns,
        WrenchSample((1.0, 2.0, float(number)), (0.0, 0.0, 0.0), time_ns, time_ns, number),
        JointSample((float(number), 1.0), time_ns, time_ns, number),
        requested,
        AppliedCommand(applied, reason),
    )


def log_of(*ticks, calls=(), losses=()):
    return TrialLog("a.mcap", 0, START, [encode(t) for t in ticks], list(calls), losses=list(losses))


def arm_over(tape):
    arm = ReplayArm(tape)
    arm.configure()
    arm.activate()
    return arm


def test_a_port_that_failed_fails_again_with_the_same_words():
    broken = replace(tick(1), wrench=None, joints=None, requested_rad=None, applied=None)
    call = CallEntry(tick=1, port="force_sensor", call="read", error="DeviceError", text="JR3: cable pulled")
    tape = Tape(log_of(tick(0), broken, calls=(call,)))
    with ReplaySensor("force", tape.wrenches) as sensor:
        sensor.read()
        with pytest.raises(DeviceError, match=r"^JR3: cable pulled$"):
            sensor.read()


def test_an_equal_command_is_answered_as_it_was():
    tape = Tape(log_of(tick(0), tick(1, reason=CommandReason.VELOCITY_LIMIT)))
    arm = arm_over(tape)
    assert arm.send(JointCommand((0.5, 0.0))) == AppliedCommand((0.5, 0.0))
    assert arm.send(JointCommand((0.5, 0.0))) == AppliedCommand((0.25, 0.0), CommandReason.VELOCITY_LIMIT)
    assert tape.differences.count == 0


@pytest.mark.parametrize("other", [(0.5, -0.0), (0.5000000000000001, 0.0)])
def test_another_bit_is_another_command(other):
    tape = Tape(log_of(tick(0), tick(1)))
    arm = arm_over(tape)
    tape.tick = 0
    # From then on nobody knows what the arm would have done: it is taken to do as asked.
    assert arm.send(JointCommand(other)).position_rad == other
    first = tape.differences.first
    assert (first.tick, first.channel) == (0, "/tick")
    assert first.field in {"requested_rad[0]", "requested_rad[1]"}
    assert tape.differences.first_command_tick == 0
    assert tape.differences.first_gross is None
    assert arm.send(JointCommand((3.0, 3.0))) == AppliedCommand((3.0, 3.0))


def test_a_command_applied_as_asked_must_be_the_one_asked_for():
    forged = replace(tick(0), applied=AppliedCommand((0.5, -0.0)))
    tape = Tape(log_of(forged))
    arm_over(tape).send(JointCommand((0.5, 0.0)))
    assert tape.differences.first.field == "applied_rad[1]"


def test_after_stop_the_arm_holds():
    tape = Tape(log_of(tick(0)))
    arm = arm_over(tape)
    arm.send(JointCommand((0.5, 0.0)))
    arm.stop()
    arm.stop()
    assert arm.send(JointCommand((9.0, 9.0))) == AppliedCommand((0.5, 0.0), CommandReason.STOPPED)


@pytest.mark.parametrize(
    ("numbers", "line"), [((5, 6), "tick 0: ticks 0 to 4 are missing"), ((0, 1, 4), "tick 2: ticks 2 to 3 are missing")]
)
def test_missing_ticks_are_reported(numbers, line):
    lost = LossEntry(tick=4, problem="queue full", text="the writer was behind", dropped_messages=2)
    clock = ReplayClock(Tape(log_of(*map(tick, numbers), losses=(lost,))))
    readings = (clock.now_ns() for _ in numbers)
    with pytest.raises(LogError) as message:
        list(readings)
    assert line in str(message.value)
    assert "queue full" in str(message.value)


def test_a_sleep_until_another_time_is_a_difference():
    tape = Tape(log_of(tick(0)))
    ReplayClock(tape).sleep_until(1)
    assert tape.differences.first.field == "deadline_ns"


GOLDEN = Path(__file__).parents[3] / "golden"


@pytest.fixture
def log():
    return read_log(GOLDEN / "train-paper.mcap")


@pytest.mark.parametrize(
    ("setting", "table"),
    [
        ("task.area_centre=start", {"task": {"area_centre": "start"}}),
        ("perception.channels=['x', 'y']", {"perception": {"channels": ["x", "y"]}}),
        ("task.goal.x_mm=1", {"task": {"goal": {"x_mm": 1}}}),
    ],
)
def test_settings_as_they_are_written(setting, table):
    assert parse_setting(setting) == table


@pytest.mark.parametrize(
    "setting", ["", "=", "task", "task.=1", ".x=1", "cell.substeps=2", "recording.enabled=false", "arm=ur5"]
)
def test_settings_that_are_none(setting):
    with pytest.raises(ConfigurationError):
        parse_setting(setting)


def test_settings_lie_over_the_log_s_own_configuration(log):
    config = changed_config(log, Changes(settings=("task.press_kgf=0.4",)))
    assert config == replace(config_of(log), task=replace(config_of(log).task, press_kgf=0.4))


@pytest.mark.parametrize(("limit_N", "weakened"), [(20, ()), (35, ("max_force_N",))])
def test_a_limit_that_was_weak_may_be_set_stronger(log, limit_N, weakened):
    weak = overlay(config_of(log), {"supervision": {"max_force_N": 40.0, "weakened": ["max_force_N"]}})
    log.start = replace(log.start, config_toml=to_toml(weak))
    supervision = changed_config(log, Changes(settings=(f"supervision.max_force_N={limit_N}",))).supervision
    assert (supervision.max_force_N, supervision.weakened) == (limit_N, weakened)


@pytest.mark.parametrize(
    "fields",
    [
        {"config_toml": "[task]\nsteps_of_another_version = 1\n"},
        {"perception_json": "{}"},
        {"policy_json": "{}"},
        {"policy": "a policy of another version"},
        {"learner_json": "{}"},
        {"tip_rotation": (1.0, 0.0)},
        {"world_json": "not json"},
    ],
    ids=str,
)
def test_a_start_that_was_altered_is_told_not_raised_through(log, fields):
    log.start = replace(log.start, **fields)
    with pytest.raises(PalpateError):
        Rebuilder().rebuild(log)


def test_omniscience_needs_to_know_the_hole():
    log = read_log(GOLDEN / "oracle-blind.mcap")
    world = {name: each for name, each in json.loads(log.start.world_json).items() if name != "hole_in_task_m"}
    log.start = replace(log.start, world_json=json.dumps(world))
    policy = Rebuilder().rebuild(log).policy
    with pytest.raises(LogError, match="where the hole was"):
        policy._hole_m()


@pytest.mark.parametrize(
    ("source", "message"), [("drift", "No module named 'gone'"), ("person", "a person chose the actions")]
)
def test_actions_of_a_person_or_of_code_that_is_gone_come_from_the_log(log, source, message):
    document = PolicyDocument.from_json_text(log.start.policy_json)
    document = replace(document, learner=None, third_party=ThirdPartyEntry("gone:Policy", "", "", "", 0))
    log.start = replace(log.start, policy="gone:Policy", policy_json=document.to_json_text(), learner_json="")
    log.decisions = [replace(each, source=source) for each in log.decisions]
    rebuilder = Rebuilder()
    assert message in rebuilder.rebuild(log).recorded_decisions
    # The next trial of the run has its own.
    after = copy(log)
    assert rebuilder.rebuild(after).policy.log is after
    with pytest.raises(LogError, match="the log cannot answer a what-if"):
        Rebuilder(Changes(settings=("task.press_kgf=0.4",))).rebuild(log)


def test_an_oracle_asked_what_it_would_do_knows_the_hole_of_each_log(log):
    rebuilder, holes = Rebuilder(Changes(policy="oracle", policy_name="oracle")), []
    for x_m in (0.001, 0.002):
        world = json.loads(log.start.world_json) | {"hole_in_task_m": [x_m, 0.0, 0.0]}
        other = copy(log)
        other.start = replace(log.start, world_json=json.dumps(world))
        holes.append(rebuilder.rebuild(other).policy._hole_m()[0])
    assert holes == [0.001, 0.002]
