"""The schema is what readers without palpate see of it: they must be able to do with the file alone."""

import dataclasses
from pathlib import Path
from typing import Any

import pytest
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory

from palpate.adapters.log import log_pb2
from palpate.adapters.log.messages import encode_record
from palpate.adapters.log.records import (
    CallEntry,
    DecisionEntry,
    EndRecord,
    EventEntry,
    LossEntry,
    ReinforcementEntry,
    StartRecord,
    TickRecord,
)
from palpate.adapters.log.schema import CHANNELS, KINDS, PACKAGE, REASONS, VALIDITIES, descriptor_set, message_class
from palpate.core.ports import CommandReason, JointSample, Validity, WrenchKind, WrenchSample
from tests.unit.adapters.log.crafted import tick_record


def foreign_class(message: str) -> Any:
    """The message as a stranger makes it of what lies in the file."""
    files = descriptor_pb2.FileDescriptorSet.FromString(descriptor_set(message))
    pool = descriptor_pool.DescriptorPool()
    for file in files.file:
        pool.Add(file)
    return message_factory.GetMessageClass(pool.FindMessageTypeByName(f"{PACKAGE}.{message}"))


def test_a_stranger_reads_a_tick_with_the_file_alone() -> None:

    made = foreign_class("Tick").FromString(encode_record("Tick", tick_record(5)))
    assert made.tick == 5
    assert made.wrench.force_N[2] == -5.0
    assert made.wrench.frame == "sensor"
    assert made.DESCRIPTOR.fields_by_name["reason"].enum_type.values_by_number[made.reason].name == "REASON_AS_ASKED"


RECORDS = {
    "Wrench": WrenchSample, "Joints": JointSample, "Start": StartRecord, "Tick": TickRecord, "Call": CallEntry,
    "Decision": DecisionEntry, "Reinforcement": ReinforcementEntry, "Event": EventEntry, "Recorder": LossEntry,
    "End": EndRecord,
}  # fmt: skip


@pytest.mark.parametrize("message", RECORDS)
def test_messages_have_the_fields_of_the_records(message: str) -> None:
    names = [field.name for field in dataclasses.fields(RECORDS[message])]
    if "applied" in names:
        place = names.index("applied")
        names[place : place + 1] = ["applied_rad", "reason"]
    made = log_pb2.DESCRIPTOR.message_types_by_name[message]
    assert [(field.name, field.number) for field in made.fields] == list(zip(names, range(1, 99), strict=False))
    assert [field.name for field in foreign_class(message).DESCRIPTOR.fields] == names


@pytest.mark.parametrize(
    ("kind", "members", "every"),
    [("Validity", VALIDITIES, Validity), ("Kind", KINDS, WrenchKind), ("Reason", REASONS, CommandReason)],
)
def test_enumerations_have_the_members_of_the_ports(kind: str, members: tuple[Any, ...], every: Any) -> None:
    values = log_pb2.DESCRIPTOR.enum_types_by_name[kind].values_by_number
    assert {number: value.name for number, value in values.items()} == {
        number: f"{kind.upper()}_{member.name}" for number, member in enumerate(members)
    }
    assert set(members) == set(every)


def test_every_channel_has_a_message() -> None:
    assert [kind.id for kind in CHANNELS] == list(range(1, len(CHANNELS) + 1))
    assert {kind.message for kind in CHANNELS} == set(RECORDS) - {"Wrench", "Joints"}


def test_the_generated_module_is_that_of_the_proto_file(tmp_path: Path) -> None:
    protoc: Any = pytest.importorskip("grpc_tools.protoc")
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


def test_logs_of_the_first_version_stay_readable() -> None:
    # Bytes as they lie in logs that exist: field numbers and kinds must never change.
    event: Any = message_class("Event").FromString(bytes.fromhex("0905000000000000001204686f6c651a0161"))
    assert (event.tick, event.name, event.detail) == (5, "hole", "a")
    tick: Any = message_class("Tick").FromString(
        bytes.fromhex("0903000000000000001104000000000000001905000000000000003208000000000000f03f4003")
    )
    assert (tick.tick, tick.time_ns, tick.deadline_ns, list(tick.asked_rad), tick.reason) == (3, 4, 5, [1.0], 3)
