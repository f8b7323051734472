"""Records as protobuf bytes: every bit comes back, and readers without palpate can do with the file alone."""

import dataclasses
import types
import typing
from dataclasses import replace
from pathlib import Path

import pytest
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from google.protobuf.message import DecodeError
from grpc_tools import protoc
from hypothesis import given
from hypothesis import strategies as st

from palpate.adapters.log import CallEntry, EndRecord, EventEntry, TickRecord, encode, log_pb2
from palpate.adapters.log.messages import decode
from palpate.adapters.log.schema import CHANNELS, PACKAGE, descriptor_set, message_class
from palpate.core.ports import AppliedCommand, CommandReason, JointSample, Validity, WrenchKind, WrenchSample
from tests.unit.adapters.log.made_logs import STARTING, tick

WHOLE = st.integers(-(2**63), 2**63 - 1)
VECTORS = st.lists(st.floats(), min_size=1, max_size=9).map(tuple)
FINITE = st.lists(st.floats(allow_nan=False, allow_infinity=False), min_size=1, max_size=7).map(tuple)
THREE = st.tuples(*[st.floats()] * 3)
VALUES = {
    int: WHOLE,
    float: st.floats(),
    str: st.text(),
    bool: st.booleans(),
    WrenchSample: st.builds(
        WrenchSample, THREE, THREE, WHOLE, WHOLE, WHOLE, st.just(Validity.INVALID), st.sampled_from(WrenchKind)
    ),
    JointSample: st.builds(JointSample, VECTORS, WHOLE, WHOLE, WHOLE, st.just(Validity.INVALID)),
    AppliedCommand: st.builds(AppliedCommand, FINITE, st.sampled_from(CommandReason)),
}


def values_of(hint):
    """Any value of a field's type."""
    if isinstance(hint, types.UnionType):
        return st.one_of(*map(values_of, typing.get_args(hint)))
    if hint is type(None):
        return st.none()
    return VECTORS if typing.get_origin(hint) is tuple else VALUES[hint]


def records_of(kind):
    hints = typing.get_type_hints(kind)
    return st.builds(kind, **{field.name: values_of(hints[field.name]) for field in dataclasses.fields(kind)})


@pytest.mark.parametrize("kind", CHANNELS, ids=lambda kind: kind.message)
@given(data=st.data())
def test_every_bit_of_a_record_comes_back(kind, data):
    record = data.draw(records_of(kind.record))
    # Which tells -0.0 from 0.0, and takes a NaN for itself.
    assert repr(decode(kind.record, encode(record))) == repr(record)


@pytest.mark.parametrize("field", ["validity", "kind", "reason"])
def test_tick_that_does_not_say_how_far_to_trust_a_sample_or_why_a_command_differs_is_refused(field):
    made = message_class("Tick").FromString(encode(tick(3)))
    (made if field == "reason" else made.wrench).ClearField(field)
    with pytest.raises(ValueError, match="is missing, or unknown"):
        decode(TickRecord, made.SerializeToString())


def test_other_bytes_are_refused():
    for kind in (EndRecord, CallEntry):
        with pytest.raises(DecodeError):
            decode(kind, b"\xff\xff\xff")
    # Protobuf itself would hand it over as bytes.
    with pytest.raises(ValueError, match="detail is no text"):
        decode(EventEntry, encode(EventEntry(tick=0, name="a")) + b"\x1a\x01\xff")


def test_field_of_another_version_is_passed_over():
    payload = encode(EventEntry(tick=1, name="hole")) + b"\xfa\x06\x01x"
    assert decode(EventEntry, payload) == EventEntry(tick=1, name="hole")
    # A call's sample, which is written no more.
    call = CallEntry(tick=1, port="arm", call="stop")
    assert decode(CallEntry, encode(call) + b"\x2a\x00") == call


def foreign_class(message):
    """The message as a stranger makes it of what lies in the file."""
    files = descriptor_pb2.FileDescriptorSet.FromString(descriptor_set(message))
    pool = descriptor_pool.DescriptorPool()
    for file in files.file:
        pool.Add(file)
    return message_factory.GetMessageClass(pool.FindMessageTypeByName(f"{PACKAGE}.{message}"))


def test_tick_is_read_with_the_file_alone():
    made = foreign_class("Tick").FromString(encode(tick(5)))
    assert made.tick == 5
    assert made.wrench.force_N[2] == 3.0
    assert made.wrench.frame == "sensor"
    assert (
        made.DESCRIPTOR.fields_by_name["reason"].enum_type.values_by_number[made.reason].name == "REASON_AS_REQUESTED"
    )


def test_generated_module_is_that_of_the_proto_file(tmp_path):
    source = Path(str(log_pb2.__file__)).with_name("log.proto")
    root = source.parents[3]
    name = source.relative_to(root).as_posix()
    words = ["protoc", f"-I{root}", f"--descriptor_set_out={tmp_path / 'set'}", name]
    assert protoc.main(words) == 0
    made = descriptor_pb2.FileDescriptorSet.FromString((tmp_path / "set").read_bytes())
    ours = descriptor_pb2.FileDescriptorProto()
    log_pb2.DESCRIPTOR.CopyToProto(ours)
    for file in (made.file[0], ours):
        for message in file.message_type:
            for field in message.field:
                field.ClearField("json_name")
    assert made.file[0] == ours


def test_numbers_of_fields_never_change():
    # Bytes as they lie in logs that exist.
    event = decode(EventEntry, bytes.fromhex("0905000000000000001204686f6c651a0161"))
    assert event == EventEntry(tick=5, name="hole", detail="a")
    payload = bytes.fromhex("0903000000000000001104000000000000001905000000000000003208000000000000f03f")
    assert decode(TickRecord, payload) == TickRecord(3, 4, 5, requested_rad=(1.0,))


@pytest.mark.parametrize(("index", "number"), [(0, 0), (349, 349), (500_000, 0), (500_003, 3)])
def test_trial_is_numbered_as_its_file_and_the_tables_of_its_run(index, number):
    assert replace(STARTING, trial=index).number == number
