"""The schema is what readers without palpate see of it: they must be able to do with the file alone."""

from typing import Any

import pytest
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory

from palpate.adapters.log.file import describe_channels
from palpate.adapters.log.messages import encode_record
from palpate.adapters.log.schema import CHANNELS, MESSAGES, PACKAGE, descriptor_set, message_class
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


@pytest.mark.parametrize("message", [kind.message for kind in CHANNELS])
def test_every_channel_has_a_whole_schema(message: str) -> None:
    assert {f.name for f in foreign_class(message).DESCRIPTOR.fields} == {name for name, _, _ in MESSAGES[message]}


def test_channels_are_numbered_as_a_writer_numbers_them() -> None:
    # The MCAP library counts channels from 1 in the order in which they are announced.
    assert [kind.id for kind in CHANNELS] == list(range(1, len(CHANNELS) + 1))
    assert [told["topic"] for told in describe_channels()] == [kind.topic for kind in CHANNELS]


def test_logs_of_the_first_version_stay_readable() -> None:
    # Bytes as they lie in logs that exist: field numbers and kinds must never change.
    event: Any = message_class("Event").FromString(bytes.fromhex("0905000000000000001204686f6c651a0161"))
    assert (event.tick, event.name, event.detail) == (5, "hole", "a")
    tick: Any = message_class("Tick").FromString(
        bytes.fromhex("0903000000000000001104000000000000001905000000000000003208000000000000f03f4003")
    )
    assert (tick.tick, tick.time_ns, tick.deadline_ns, list(tick.asked_rad), tick.reason) == (3, 4, 5, [1.0], 3)
