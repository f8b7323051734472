"""Small logs made for a test: everything in them is said by the test itself."""

from dataclasses import replace
from io import BytesIO

import pytest
from mcap.writer import CompressionType, Writer

from palpate.adapters.config import scenario, to_toml
from palpate.adapters.log import (
    SCHEMA,
    DecisionEntry,
    EndRecord,
    EventEntry,
    LogFile,
    RawMessage,
    StartRecord,
    TickRecord,
    encode,
)
from palpate.adapters.log.container import read_messages
from palpate.adapters.log.reader import assemble
from palpate.adapters.log.schema import BY_ID, BY_RECORD, PACKAGE, descriptor_set
from palpate.core.errors import LogError
from palpate.core.ports import AppliedCommand, JointSample, WrenchSample

PERIOD_NS = 1_000_000_000 // 140
POSTURE = (0.0, 1.0752755, -1.4561609, 0.0, 0.6101755, 0.0)
"""The zebra-zero above its goal."""


def start(**changes):
    """What a trial of the paper's scenario starts with."""
    record = StartRecord(
        schema=SCHEMA, command="train", config_toml=to_toml(scenario("paper")), arm="zebra-zero", model_sha256="",
        core_sha256="", seed=7, trial=3, start_m=(0.001, 0.0), ready_rad=POSTURE,
        tip_rotation=(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0), perception_json="{}",
        policy="document", world="simulator", versions_json='{"palpate":"0.1.0"}',
    )  # fmt: skip
    return replace(record, **changes)


STARTING = start()
ENDING = EndRecord(tick=39, outcome="inserted", exploration_time_s=0.5, actions=2, ticks=40, success=True)


def tick(number, **changes):
    """A whole tick; the numbers in it tell its own number."""
    now = number * PERIOD_NS
    record = TickRecord(
        tick=number,
        time_ns=now,
        deadline_ns=now,
        wrench=WrenchSample((0.1 * number, -1.0, 3.0), (0.01, 0.02, 0.03), now - 2_000_000, now, number),
        joints=JointSample(tuple(q + 1e-4 * number for q in POSTURE), now, now, number),
        requested_rad=POSTURE,
        applied=AppliedCommand(POSTURE),
    )
    return replace(record, **changes)


def messages_of(records):
    """The messages of records, each at the time of its tick."""
    return [
        RawMessage(BY_RECORD[type(each)].id, max(getattr(each, "tick", 0), 0) * PERIOD_NS, encode(each), number)
        for number, each in enumerate(records)
    ]


def messages(ticks=40, begin=STARTING, end=ENDING):
    """Those of one trial: ticks with a decision after every 14, an event, and its end."""
    records = [] if begin is None else [begin]
    for number in range(ticks):
        records.append(tick(number))
        if number % 14 == 13:
            choice = {"symbol": "x0", "state": "x0", "action": "+x", "source": "learned"}
            records.append(DecisionEntry(tick=number, number=number // 14, **choice))
    records.append(EventEntry(tick=39, name="hole", detail="found"))
    return messages_of([*records, end] if end is not None else records)


def log_bytes(content=None):
    """A log as our recorder writes it, but for the numbers of messages, which are as given."""
    stream, left = BytesIO(), list(messages() if content is None else content)
    log = LogFile(stream, {"schema": SCHEMA})
    for first in range(0, len(left), 14):
        log.add(left[first : first + 14])
    log.finish()
    return stream.getvalue()


def write_log(path, ticks, *, begin=None, others=(), end=None):
    """A sound log with these messages; those besides the ticks come when their tick does."""
    records = [begin or STARTING]
    left = sorted(others, key=lambda entry: entry.tick)
    for record in ticks:
        records.append(record)
        records += [entry for entry in left if entry.tick <= record.tick]
        left = [entry for entry in left if entry.tick > record.tick]
    path.write_bytes(log_bytes(messages_of(records if end is None else [*records, end])))
    return path


def rewritten(content=None, *, third_party=False, **settings):
    """The same messages as another tool would write them: channels numbered otherwise, one more in between."""
    stream = BytesIO()
    options = {"compression": CompressionType.ZSTD} | settings
    writer = Writer(stream, **options)
    writer.start(profile="other", library="other tool")
    note = writer.register_schema("Note", "jsonschema", b"{}")
    channels = {0: writer.register_channel("/note", "json", note)}
    for kind in () if third_party else reversed(BY_ID.values()):
        schema = writer.register_schema(f"{PACKAGE}.{kind.message}", "protobuf", descriptor_set(kind.message))
        channels[kind.id] = writer.register_channel(kind.topic, "protobuf", schema)
    writer.add_message(channels[0], 0, b'{"text": "rewritten"}', 0)
    for message in messages() if content is None else content:
        payload = b"{}" if third_party else message.payload
        channel = channels[0 if third_party else message.channel]
        writer.add_message(channel, message.time_ns, payload, message.time_ns, message.sequence)
    writer.finish()
    return stream.getvalue()


def read(data):
    """As :func:`read_log` reads a file, its ticks too."""
    log = assemble("x.mcap", data, *read_messages("x.mcap", data))
    list(log.records())
    return log


def complaint(data):
    """What reading it is refused with."""
    with pytest.raises(LogError) as caught:
        read(data)
    text = str(caught.value)
    assert text.startswith("x.mcap: ")
    assert "\n" not in text
    assert "; " in text  # what to do comes last
    return text
