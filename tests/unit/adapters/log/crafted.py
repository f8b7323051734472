"""Logs made by hand, small and quick: what a tick holds follows from its number, so that any reading can be checked."""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from io import BytesIO
from math import sin
from typing import Any

import pytest
from mcap.writer import CompressionType, Writer

from palpate.adapters.log.container import RawMessage, message_record, read_messages
from palpate.adapters.log.file import LogFile
from palpate.adapters.log.messages import encode_record
from palpate.adapters.log.reader import TrialLog, assemble
from palpate.adapters.log.records import DecisionEntry, EndRecord, EventEntry, StartRecord, TickRecord
from palpate.adapters.log.schema import BY_ID, DECISION, END, EVENT, PACKAGE, SCHEMA, START, TICK, descriptor_set
from palpate.core.errors import LogError
from palpate.core.ports.values import AppliedCommand, CommandReason, JointSample, JointVector, WrenchSample

STARTING = StartRecord(
    schema=SCHEMA,
    command="train",
    config_toml="seed = 3\n",
    arm="zebra-zero",
    model_sha256="0" * 64,
    core_sha256="1" * 64,
    seed=3,
    trial=7,
    start_m=(0.001, -0.002),
    ready_rad=(0.1, -0.2, 0.3, 0.4, -0.5, 0.6),
    tip_rotation=(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0),
    perception_json="{}",
    policy="torque",
)
ENDING = EndRecord(tick=39, outcome="inserted", exploration_time_s=0.5, actions=2, ticks=40, success=True)


def time_of(tick: int) -> int:
    return tick * 1_000_000_000 // 140


def joints_at(tick: int, joints: int = 6) -> JointVector:
    return tuple(sin(0.01 * tick + joint) for joint in range(joints))


def tick_record(tick: int, joints: int = 6) -> TickRecord:
    """A whole tick."""
    now, asked = time_of(tick), joints_at(tick + 1, joints)
    return TickRecord(
        tick=tick,
        time_ns=now,
        deadline_ns=now,
        wrench=WrenchSample((sin(tick), 0.5, -5.0), (0.1, -0.0, 1e-300), now, now, tick + 1),
        joints=JointSample(joints_at(tick, joints), now, now, tick + 1),
        asked_rad=asked,
        applied=AppliedCommand(asked, CommandReason.AS_ASKED),
    )


def messages(
    ticks: Iterable[int] = range(40), *, start: StartRecord | None = STARTING, end: EndRecord | None = ENDING
) -> list[RawMessage]:
    """Those of one trial."""
    made = [] if start is None else [RawMessage(START.id, 0, encode_record("Start", start))]
    for tick in ticks:
        made.append(RawMessage(TICK.id, time_of(tick), encode_record("Tick", tick_record(tick))))
        if tick % 14 == 13:
            choice = DecisionEntry(tick=tick, number=tick // 14, symbol="x0", state="x0", action="+x", source="learned")
            made.append(RawMessage(DECISION.id, time_of(tick), encode_record("Decision", choice)))
    last = made[-1].time_ns
    made.append(RawMessage(EVENT.id, last, encode_record("Event", EventEntry(tick=39, name="hole", detail="found"))))
    made += [] if end is None else [RawMessage(END.id, last, encode_record("End", end))]
    return [message._replace(sequence=number) for number, message in enumerate(made)]


def log_bytes(content: Sequence[RawMessage] | None = None) -> bytes:
    """A log as our recorder writes it, but for the numbers of messages, which are as given."""
    stream = BytesIO()
    log = LogFile(stream, {"schema": SCHEMA})
    left = list(messages() if content is None else content)
    while left:
        log.add(b"".join(map(message_record, left[:14])))
        del left[:14]
    log.finish()
    return stream.getvalue()


def rewritten(content: Sequence[RawMessage] | None = None, *, foreign: bool = False, **settings: Any) -> bytes:
    """The same messages as another tool would write them: channels numbered otherwise, one more in between."""
    stream = BytesIO()
    options = {"compression": CompressionType.ZSTD} | settings
    writer: Any = Writer(stream, **options)
    writer.start(profile="other", library="other tool")
    note = writer.register_schema("Note", "jsonschema", b"{}")
    channels = {0: writer.register_channel("/note", "json", note)}
    for kind in () if foreign else reversed(BY_ID.values()):
        schema = writer.register_schema(f"{PACKAGE}.{kind.message}", "protobuf", descriptor_set(kind.message))
        channels[kind.id] = writer.register_channel(kind.topic, "protobuf", schema)
    writer.add_message(channels[0], 0, b'{"text": "rewritten"}', 0)
    for message in messages() if content is None else content:
        payload = b"{}" if foreign else message.payload
        channel = channels[0 if foreign else message.channel]
        writer.add_message(channel, message.time_ns, payload, message.time_ns, message.sequence)
    writer.finish()
    return stream.getvalue()


def start_with(**changes: Any) -> StartRecord:
    return replace(STARTING, **changes)


SMALL = messages(range(6))


def read(data: bytes) -> TrialLog:
    """As :func:`read_log` reads a file, its ticks too."""
    log = assemble("x.mcap", data, *read_messages("x.mcap", data))
    list(log.records())
    return log


def complaint(data: bytes) -> str:
    """What reading it is refused with."""
    with pytest.raises(LogError) as caught:
        read(data)
    text = str(caught.value)
    assert text.startswith("x.mcap: ")
    assert "\n" not in text
    assert "; " in text  # what to do comes last
    return text
