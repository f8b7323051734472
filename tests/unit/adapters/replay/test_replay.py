"""Every output of the core is compared with the log: whatever is altered by one bit is found, at the right place."""

import json
import re
from dataclasses import replace
from itertools import count
from math import nextafter

import pytest

import palpate.core.control_loop as control_loop
from palpate.adapters.log import read_log
from palpate.adapters.replay.batch import exit_code, replay_file
from palpate.adapters.replay.differences import close_enough, same_bits
from palpate.adapters.replay.engine import Verdict, replay
from palpate.adapters.replay.rebuild import Rebuilder
from palpate.core.motion.controllers import DampingControl
from palpate.core.ports import DeviceDecorator, FaultLatch
from tests.support.log_surgery import changed, in_start, indices, messages_of, one_ulp, write_log
from tests.unit.adapters.log.made_logs import log_bytes


def diverged(one):
    """The first output that is not what was recorded."""
    assert one.verdict is Verdict.DIVERGED
    assert one.first is not None
    return one.first


@pytest.fixture
def messages(golden_here):
    return messages_of(golden_here("train-paper"))


@pytest.fixture
def replayed(tmp_path):
    """Replays a log of these messages, with checksums and counts made good."""
    numbers = count()
    return lambda messages: replay_file(write_log(tmp_path / f"{next(numbers)}.mcap", messages), Rebuilder())


def said(**fields):
    """Other values for fields of a message."""

    def change(made):
        for name, value in fields.items():
            setattr(made, name, value)

    return change


def in_wrench(**fields):
    return lambda made: said(**fields)(made.wrench)


def in_config(old, new):
    return lambda made: setattr(made, "config_toml", made.config_toml.replace(old, new, 1))


def in_policy(**settings):
    def change(made):
        document = json.loads(made.policy_json)
        document["learner"]["parameters"].update(settings)
        made.policy_json = json.dumps(document)

    return change


def teach(place):
    """One visit more in the learner's state."""

    def change(made):
        learner = json.loads(made.learner_json)
        learner[place][0][0] += 1
        made.learner_json = json.dumps(learner)

    return change


def one_value(made):
    """One bit more in a value that was learned."""
    learner = json.loads(made.learner_json)
    learner["q"][3][1] = nextafter(learner["q"][3][1], 1.0)
    made.learner_json = json.dumps(learner)


@pytest.mark.parametrize(
    ("topic", "number", "change", "field"),
    [
        # One and the same number: as asked, it contradicts the core; as applied, it contradicts what was asked.
        *(
            ("/tick", tick, one_ulp(field, joint), f"{field}[{joint}]")
            for tick, joint in ((0, 0), (1, 2), (270, 5))
            for field in ("requested_rad", "applied_rad")
        ),
        ("/end", 0, said(error="DeviceError", text="arm: cable pulled"), "error"),
        ("/end", 0, said(text="all well"), "text"),
        ("/end", 0, said(raised_by="core"), "raised_by"),
        ("/end", 0, said(outcome="inserted"), "outcome"),
        ("/end", 0, said(outcome="", error="KeyboardInterrupt", raised_by="outside"), "error"),
        ("/end", 0, said(success=True), "success"),
        ("/end", 0, lambda made: made.ClearField("success"), "success"),
        ("/end", 0, said(ticks=3), "ticks"),
        ("/end", 0, said(tick=3), "tick"),
        ("/end", 0, said(actions=7), "actions"),
        ("/end", 0, said(clamped_ticks=1), "clamped_ticks"),
        ("/end", 0, said(counterfactual=True), "counterfactual"),
        ("/end", 0, teach("visits"), "learner.visits[0][0]"),
        ("/end", 0, one_value, "learner.q[3][1]"),
        *(("/end", 0, one_ulp(field), field) for field in ("exploration_time_s", "peak_force_N", "depth_m")),
        ("/decision", 0, one_ulp("temperature"), "temperature"),
        *(("/decision", n, said(**{f: "x- y-x"}), f) for f in ("action", "symbol", "state", "source") for n in (0, -1)),
        ("/decision", 3, one_ulp("grounds", 4), "grounds[4]"),
        ("/reinforcement", 0, one_ulp("reinforcement"), "reinforcement"),
        ("/reinforcement", -1, one_ulp("reinforcement"), "reinforcement"),
        ("/tick", 7, lambda made: setattr(made, "deadline_ns", made.deadline_ns + 1), "deadline_ns"),
        ("/tick", 150, lambda made: made.wrench.force_N.__setitem__(2, -7.0), "requested_rad[1]"),
        ("/start", 0, in_start(generator_json={"bit_generator": "PCG64"}), "generator"),
        ("/event", 2, said(counterfactual=True), "counterfactual"),
        ("/decision", 1, said(counterfactual=True), "counterfactual"),
        ("/tick", 7, said(counterfactual=True), "counterfactual"),
        ("/tick", 150, in_wrench(frame="base"), "requested_rad[0]"),
        ("/tick", 150, in_wrench(kind=1), "requested_rad[0]"),
        ("/start", 0, in_start(arm="ur5"), "arm"),
        ("/start", 0, in_config("seed = 11", "seed = 12"), "seed"),
        ("/start", 0, in_policy(initial_value=-4.0), "policy.learner.parameters.initial_value"),
        ("/start", 0, one_ulp("temperature"), "temperature"),
        ("/start", 0, one_ulp("tip_rotation", 4), "ready pose[10]"),
        ("/start", 0, one_ulp("filter_state", 2), "filter_state[2]"),
        ("/start", 0, lambda made: made.perception_state.append(1.0), "perception_state"),
        ("/start", 0, teach("visits"), "learner.visits[0][0]"),
        ("/call", -1, said(call="halt"), "call"),
        ("/call", -1, said(error="DeviceError", text="no answer"), "error"),
    ],
)
def test_a_field_that_is_altered(messages, replayed, topic, number, change, field):
    first = diverged(replayed(changed(messages, indices(messages, topic)[number], change)))
    assert first.field == field
    assert topic != "/tick" or first.tick == number


@pytest.mark.parametrize(
    ("topic", "field"), [("/decision", "grounds"), ("/decision", "displacement_m"), ("/end", "raised_by")]
)
def test_a_field_that_was_taken_away_is_missed(golden_here, replayed, topic, field):
    log = messages_of(golden_here("first-kind" if field == "raised_by" else "train-paper"))
    lacking = changed(log, indices(log, topic)[0], lambda made: made.ClearField(field))
    assert diverged(replayed(lacking)).field == field


def test_a_log_that_lacks_a_message_is_refused_with_its_tick(messages, tmp_path):
    gone = indices(messages, "/decision")[1]
    path = tmp_path / "filtered.mcap"
    path.write_bytes(log_bytes(messages[:gone] + messages[gone + 1 :]))
    one = replay_file(path, Rebuilder())
    assert one.verdict is Verdict.REFUSED
    assert re.search(rf"message {gone}, after tick \d+, is missing; a trial can only be replayed whole", one.problem)


@pytest.mark.parametrize("share", [0.3, 0.9, 0.99])
def test_a_log_that_was_cut_replays_as_far_as_it_goes(golden_here, tmp_path, share):
    data, path = golden_here("train-paper").read_bytes(), tmp_path / "cut.mcap"
    path.write_bytes(data[: int(share * len(data))])
    one = replay_file(path, Rebuilder())
    assert one.verdict is Verdict.CUT_SHORT
    assert one.note.startswith("offset ")
    assert one.ticks > 10
    assert exit_code([one], strict=False) == 2


@pytest.mark.parametrize(
    ("name", "note"), [("train-paper", ""), ("aborted", "the recording was ended by DeviceError at tick 20")]
)
def test_note_names_what_ended_a_recording_from_outside(golden_here, name, note):
    one = replay(read_log(golden_here(name)), Rebuilder())
    assert one.verdict is Verdict.EQUAL
    assert one.note == note


@pytest.mark.parametrize(("topic", "field"), [("/end", "learner_json"), ("/start", "versions_json")])
def test_a_field_that_is_no_json(messages, replayed, topic, field):
    for text, says in (("x", "is not JSON"), ("3", "is not a JSON object")):
        one = replayed(changed(messages, indices(messages, topic)[0], said(**{field: text})))
        assert (one.verdict, f"{topic} {field}: {says}" in one.problem) == (Verdict.REFUSED, True)


def test_a_port_that_failed_without_a_failed_call(golden_here, replayed):
    whole = messages_of(golden_here("force-sensor-gone"))
    failed = indices(whole, "/call")[1]
    assert diverged(replayed(whole[:failed] + whole[failed + 1 :])).field == "error"
    for other in ("outside", "nobody"):
        assert diverged(replayed(changed(whole, indices(whole, "/end")[0], said(raised_by=other)))).field == "raised_by"


@pytest.mark.parametrize("topic", ["/decision", "/event", "/reinforcement"])
@pytest.mark.parametrize("number", [0, 1, -1])
def test_a_message_that_is_missing(messages, replayed, topic, number):
    del messages[indices(messages, topic)[number]]
    assert diverged(replayed(messages)).channel == topic


def test_a_gain_in_the_core_that_is_other_by_one_part_in_a_million_million(golden_here, monkeypatch):
    controller = DampingControl.__init__

    def changed_gain(self, damping, *others):
        controller(self, damping * (1.0 + 1e-12), *others)

    monkeypatch.setattr(DampingControl, "__init__", changed_gain)
    first = diverged(replay_file(golden_here("train-paper"), Rebuilder()))
    assert first.field.startswith("requested_rad")


@pytest.mark.parametrize("field", ["true_depth_m", "true_peak_force_N"])
def test_a_truth_that_contradicts_the_score(golden_here, replayed, field):
    whole = messages_of(golden_here("torque-ur5"))
    lie = said(**{field: 0.001 if "depth" in field else 99.0})
    assert diverged(replayed(changed(whole, indices(whole, "/end")[0], lie))).field == "success"


def test_a_stop_that_is_missing_or_made_up(messages, replayed):
    stop = indices(messages, "/call")[-1]
    for altered in (messages[:stop] + messages[stop + 1 :], [*messages[:stop], messages[stop], *messages[stop:]]):
        assert diverged(replayed(altered)).field == "number of port calls"


def test_in_the_simulator_records_are_compared_as_long_as_commands_are_equal(golden_here):
    log = read_log(golden_here("oracle-blind"))
    event = log.events[2]
    log.events[2] = replace(event, detail="another")
    one = replay(log, Rebuilder(), in_mujoco=True)
    assert (diverged(one).channel, one.counterfactual_from) == ("/event", None)


class _Unstoppable(DeviceDecorator):
    """An arm that no stop reaches."""

    def __init__(self, arm):
        super().__init__(arm)
        self.send = arm.send

    def stop(self): ...


def test_a_core_that_does_not_stop_the_arm(golden_here, monkeypatch):
    stop = control_loop._stop
    monkeypatch.setattr(control_loop, "_stop", lambda arm, *others: stop(_Unstoppable(arm), *others))
    for name in ("train-paper", "torque-ur5", "spiral-force-limit"):
        first = diverged(replay_file(golden_here(name), Rebuilder()))
        assert (first.field, first.recorded, first.replayed) == ("port call", "arm.stop", None)


def test_a_log_cut_between_any_two_messages_is_judged_by_what_was_surely_written(messages, replayed):
    places = [place + more for place in indices(messages, "/decision")[:3] for more in range(-2, 3)]
    for place in places:
        one = replayed(messages[:place])
        assert one.verdict is Verdict.EQUAL, (place, one.first)
        assert "before the trial did" in one.note


@pytest.mark.parametrize(
    ("monitor", "name"),
    [
        ("SampleMonitor", "trip-frozen"),
        ("WrenchMonitor", "trip-torque-tared"),
        ("JointMonitor", "trip-tracking"),
        ("WorkspaceMonitor", "trip-workspace-x"),
    ],
)
def test_a_supervisor_with_a_watch_disarmed(golden_here, monkeypatch, monitor, name):
    monkeypatch.setattr(f"palpate.core.supervision.monitors.{monitor}.trip", lambda *_: None)
    assert replay_file(golden_here(name), Rebuilder()).verdict is Verdict.DIVERGED


def test_an_error_of_the_core_s_own_that_it_raises_no_more(golden_here, replayed, monkeypatch):
    log = golden_here("first-kind")
    messages = messages_of(log)
    by_outside = diverged(replayed(changed(messages, indices(messages, "/end")[0], said(raised_by="outside"))))
    assert (by_outside.field, by_outside.replayed) == ("raised_by", "core")
    monkeypatch.setattr("palpate.core.supervision.supervisor.require_raw", lambda *_: None)
    first = diverged(replay_file(log, Rebuilder()))
    assert (first.field, first.replayed) == ("error", "still running")


@pytest.mark.parametrize(("name", "word"), [("trip-frozen", "are identical"), ("force-sensor-gone", "force_sensor")])
def test_a_rig_that_is_latched_otherwise(golden_here, monkeypatch, name, word):
    """Nothing else shows it: a trial ends the same way."""
    for latched in (lambda latch, cause: None, lambda latch, cause: setattr(latch, "cause", "it fell off")):
        monkeypatch.setattr(FaultLatch, "set", latched)
        first = diverged(replay_file(golden_here(name), Rebuilder()))
        assert first.field == "latch"
        assert word in str(first.recorded)


def test_observers_that_are_told_of_another_port_or_of_no_beginning(golden_here, monkeypatch):
    monkeypatch.setattr(control_loop, "JOINT_ENCODER", "force_sensor")
    assert diverged(replay_file(golden_here("encoders-gone"), Rebuilder())).field == "port"
    monkeypatch.setattr(control_loop, "_listeners", lambda observers, event: ())
    assert diverged(replay_file(golden_here("straight-in"), Rebuilder())).channel == "/start"


@pytest.mark.parametrize(
    ("a", "b", "close"), [(1.0, 1.0 + 1e-10, True), (1.0, 1.0 + 1e-8, False), (0.0, 1e-13, True), (0.0, 1e-9, False)]
)
def test_what_another_processor_may_do(a, b, close):
    assert close_enough(a, b) is close


def test_bits_are_compared_not_values():
    nan = float("nan")
    assert same_bits((nan,), (nan,))
    assert not same_bits((0.0,), (-0.0,))
    assert not same_bits((0.0,), (0.0, 0.0))
