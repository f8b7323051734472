"""Sparse records come back as they were."""

import struct
from dataclasses import replace
from math import isfinite
from typing import Any

import pytest
from google.protobuf.message import DecodeError
from hypothesis import given
from hypothesis import strategies as st

from palpate.adapters.log import CallEntry, DecisionEntry, EndRecord, EventEntry, LossEntry, ReinforcementEntry
from palpate.adapters.log.messages import decode_record, decode_tick, encode_record, encode_tick
from palpate.adapters.log.records import StartRecord, TickRecord
from palpate.adapters.log.schema import message_class
from palpate.core.ports import (
    AppliedCommand,
    CommandReason,
    JointCommand,
    JointSample,
    Snapshot,
    Validity,
    WrenchKind,
    WrenchSample,
)
from tests.unit.adapters.log.crafted import ENDING, STARTING, tick_record

DECIDED = DecisionEntry(tick=14, number=1, symbol="x+ y0", state="x+ y0", action="-x", source="learned")
RECORDS = [
    ("Start", STARTING),
    (
        "Start",
        replace(
            STARTING,
            policy_json='{"ä": 1}',
            frozen=True,
            learner_json="{}",
            perception_state=(1.0,),
            filter_state=(-0.0, 1e-300),
            generator_json="[1]",
            temperature=5.0,
            world="simulator",
            world_json="{}",
            versions_json="{}",
            processor_json="{}",
            derived_from="trial-00001.mcap",
        ),
    ),
    ("Decision", DECIDED),
    ("Decision", replace(DECIDED, temperature=0.0, counterfactual=True)),
    ("Reinforcement", ReinforcementEntry(tick=28, number=1, reinforcement=-0.0, counterfactual=True)),
    ("Event", EventEntry(tick=-1, name="tare")),
    ("Recorder", LossEntry(tick=3, problem="queue full")),
    (
        "Recorder",
        LossEntry(tick=3, problem="p", text="t", dropped_messages=9, first_dropped_tick=0, last_dropped_tick=3),
    ),
    ("End", EndRecord(tick=-1)),
    ("End", ENDING),
    (
        "End",
        EndRecord(
            tick=5,
            outcome="jammed",
            exploration_time_s=-0.0,
            actions=1,
            peak_force_N=2.5,
            depth_m=-0.001,
            ticks=6,
            clamped_ticks=2,
            learner_json="{}",
            success=False,
            true_peak_force_N=0.0,
            true_depth_m=0.01,
            true_tip_in_task_m=(1.0, 2.0, 3.0),
            true_hole_in_task_m=(4.0, 5.0),
            error="DeviceError",
            text="gone",
            counterfactual=True,
            stopped_by="key: 'q' was pressed",
            timing_json='{"ticks": 3}',
            raised_by="core",
        ),
    ),
]
T = tick_record(3)
CALLS = [
    CallEntry(tick=-1, port="clock", call="now_ns", time_ns=0),
    CallEntry(tick=2, port="force_sensor", call="read", wrench=T.wrench),
    CallEntry(tick=2, port="joint_encoder", call="read", joints=T.joints),
    CallEntry(tick=2, port="arm", call="send", asked_rad=(0.5,), applied=AppliedCommand((0.4,), CommandReason.STOPPED)),
    CallEntry(tick=2, port="arm", call="send", asked_rad=(0.5,), error="DeviceError", text="does not answer"),
    CallEntry(tick=9, port="arm", call="stop"),
]


@pytest.mark.parametrize(("message", "record"), RECORDS)
def test_a_record_comes_back(message: str, record: Any) -> None:
    again = decode_record(message, type(record), encode_record(message, record))
    assert again == record
    assert repr(again) == repr(record)  # which tells -0.0 from 0.0


@pytest.mark.parametrize("call", CALLS, ids=lambda call: f"{call.port}-{call.call}")
def test_a_call_comes_back(call: CallEntry) -> None:
    assert decode_record("Call", CallEntry, encode_record("Call", call)) == call


@given(st.integers(-(2**63), 2**63 - 1), st.floats(allow_nan=False), st.text())
def test_any_number_and_any_text_comes_back(number: int, value: float, text: str) -> None:
    end = EndRecord(tick=number, depth_m=value, text=text)
    again = decode_record("End", EndRecord, encode_record("End", end))
    assert (again.tick, struct.pack("<d", again.depth_m), again.text) == (number, struct.pack("<d", value), text)


@pytest.mark.parametrize("field", ["tip_rotation", "ready_rad", "seed", "arm"])
def test_a_start_without_what_it_must_have_is_refused(field: str) -> None:
    made: Any = message_class("Start").FromString(encode_record("Start", STARTING))
    made.ClearField(field)
    with pytest.raises((TypeError, ValueError), match=field):
        decode_record("Start", StartRecord, made.SerializeToString())


@pytest.mark.parametrize("field", ["tick", "port", "call"])
def test_a_call_without_what_it_must_have_is_refused(field: str) -> None:
    made: Any = message_class("Call").FromString(encode_record("Call", CALLS[0]))
    made.ClearField(field)
    with pytest.raises(ValueError, match=field):
        decode_record("Call", CallEntry, made.SerializeToString())


NUMBERS = st.integers(-(2**63), 2**63 - 1)
VECTORS = st.tuples(*[st.floats(allow_nan=True)] * 3)
JOINTS = st.lists(st.floats(), min_size=1, max_size=7)


@given(
    NUMBERS, st.tuples(VECTORS, VECTORS), st.lists(st.floats(), min_size=1, max_size=8), st.sampled_from(CommandReason)
)
def test_every_bit_of_a_tick_comes_back(
    number: int, wrench: tuple[Any, Any], joints: list[float], reason: CommandReason
) -> None:
    sample = WrenchSample(*wrench, number, -number - 1, 2, Validity.INVALID, WrenchKind.TARED, "flange")
    encoders = JointSample(tuple(joints), 1, number, 3, Validity.INVALID)
    finite = tuple(value if isfinite(value) else -0.0 for value in joints)
    command, applied = JointCommand(finite), AppliedCommand(finite[::-1], reason)
    payload = encode_tick(5, Snapshot(number, 7, sample, encoders), command, applied)
    record = TickRecord(number, 7, 5, sample, encoders, finite, applied)
    assert payload == encode_record("Tick", record)
    again = decode_tick(payload)
    assert repr(again) == repr(record)
    bits = [struct.pack("<d", value) for value in (*wrench[0], *joints)]
    assert [struct.pack("<d", v) for v in (*again.wrench.force_N, *again.joints.position_rad)] == bits  # type: ignore[union-attr]


@pytest.mark.parametrize("parts", [{}, {"time_ns": 4}, {"time_ns": 4, "wrench": T.wrench}, {"counterfactual": True}])
def test_what_a_tick_lacks_is_absent(parts: dict[str, Any]) -> None:
    record = TickRecord(3, deadline_ns=3, **parts)
    assert decode_tick(encode_record("Tick", record)) == record


@pytest.mark.parametrize("field", ["validity", "kind"])
def test_a_sample_that_does_not_say_how_far_to_trust_it_is_refused(field: str) -> None:
    made: Any = message_class("Tick").FromString(encode_record("Tick", T))
    made.wrench.ClearField(field)
    with pytest.raises(ValueError, match="is missing, or unknown"):
        decode_tick(made.SerializeToString())


def test_other_bytes_are_refused() -> None:
    with pytest.raises(DecodeError):
        decode_record("End", EndRecord, b"\xff\xff\xff")
    with pytest.raises(DecodeError):
        decode_record("Call", CallEntry, b"\xff\xff\xff")


def test_text_that_is_none_is_refused() -> None:
    # Protobuf itself would hand it over as bytes.
    for payload in (
        b"\x09" + bytes(8) + b"\x12\x01\xff",
        encode_record("Event", EventEntry(tick=0, name="a")) + b"\x1a\x01\xff",
    ):
        with pytest.raises(ValueError, match="is no text"):
            decode_record("Event", EventEntry, payload)
    with pytest.raises(ValueError, match="text is no text"):
        decode_record("Call", CallEntry, encode_record("Call", CALLS[0]) + b"\x5a\x01\xff")


def test_a_field_of_a_newer_version_is_passed_over() -> None:
    payload = encode_record("Event", EventEntry(tick=1, name="hole")) + b"\xfa\x06\x01x"
    assert decode_record("Event", EventEntry, payload) == EventEntry(tick=1, name="hole")


@pytest.mark.parametrize(("index", "number"), [(0, 0), (349, 349), (500_000, 0), (500_003, 3)])
def test_a_trial_is_numbered_as_its_file_and_the_tables_of_its_run(index: int, number: int) -> None:
    assert replace(STARTING, trial=index).number == number
