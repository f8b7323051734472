"""The schema of a trial's log: protobuf messages, one MCAP channel each, described once and built at run time.

Numbers that must come back bit for bit are ``double`` and ``sfixed64``: a fixed width on the wire, NaN and -0.0
kept. Everything is SI and says so in its name. Every field is optional in the protobuf sense: what was not there
is absent, not zero. A changed field or meaning takes another version; a version is never used again.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any, Final, get_args, get_origin, get_type_hints

from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from google.protobuf.message import Message

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
from palpate.core.ports import AppliedCommand, CommandReason, JointSample, Validity, WrenchKind, WrenchSample

SCHEMA: Final = "palpate.log/2"
PACKAGE: Final = "palpate.log"

ENUMS: Final[Mapping[str, tuple[tuple[Any, ...], str]]] = {
    "Validity": ((Validity.VALID, Validity.SATURATED, Validity.STALE, Validity.INVALID), "VALIDITY_"),
    "Kind": ((WrenchKind.RAW, WrenchKind.TARED, WrenchKind.GRAVITY_COMPENSATED), "KIND_"),
    "Reason": (
        (
            CommandReason.AS_ASKED,
            CommandReason.POSITION_LIMIT,
            CommandReason.VELOCITY_LIMIT,
            CommandReason.STOPPED,
        ),
        "REASON_",
    ),
}
"""Enumerations: the members in the order of their numbers, and what their names begin with in the schema."""

VECTOR: Final = "double[]"
"""A packed vector of doubles: of constant length in a run, hence of constant width."""

_SCALARS: Final = {"double": 1, "sfixed64": 16, "bool": 8, "string": 9}  # protobuf's own numbers of its types
_MESSAGE, _ENUM = 11, 14
_OPTIONAL, _REPEATED = 1, 3
SAMPLES: Final[Mapping[str, Any]] = {"Wrench": WrenchSample, "Joints": JointSample}
"""Messages in other messages."""
_OF_TYPES: Final[Mapping[type, str]] = {
    float: "double", int: "sfixed64", bool: "bool", str: "string", Validity: "Validity", WrenchKind: "Kind",
    **{sample: name for name, sample in SAMPLES.items()},
}  # fmt: skip


def _fields_of(record: type) -> tuple[tuple[str, str, int], ...]:
    """The fields of a record are numbered as they stand in it, and so is what its message holds."""
    found: list[tuple[str, str]] = []
    for name, hint in get_type_hints(record).items():
        # Without the None beside it.
        kind = hint if get_origin(hint) is tuple else next(iter(get_args(hint)), hint)
        if kind is AppliedCommand:
            found += [("applied_rad", VECTOR), ("reason", "Reason")]
        else:
            found.append((name, VECTOR if get_origin(kind) is tuple else _OF_TYPES[kind]))
    return tuple((*field, number) for number, field in enumerate(found, start=1))


@dataclass(frozen=True)
class ChannelKind:
    """One channel of a log.

    Attributes:
        about: One line for whoever opens the file, with units and frames.
    """

    id: int
    topic: str
    message: str
    record: type
    about: str


START = ChannelKind(1, "/start", "Start", StartRecord, "all that the trial starts with; lengths in m in the task frame")
TICK = ChannelKind(
    2,
    "/tick",
    "Tick",
    TickRecord,
    "one message per control tick: samples, command asked and applied. Wrench: of the world on the tool, in the"
    " frame it names, N and N m; joints in rad; times in ns of the run's clock",
)
CALL = ChannelKind(
    3, "/call", "Call", CallEntry, "port calls beyond the one of each per tick: further reads, stop, errors"
)
DECISION = ChannelKind(
    4, "/decision", "Decision", DecisionEntry, "symbol, state and action chosen, its displacement in m"
)
REINFORCEMENT = ChannelKind(
    5, "/reinforcement", "Reinforcement", ReinforcementEntry, "what the decision of that number then earned"
)
EVENT = ChannelKind(6, "/event", "Event", EventEntry, "contact, tare, phases, hole, faults, the end")
RECORDER = ChannelKind(7, "/recorder", "Recorder", LossEntry, "what the recorder lost, and why")
END = ChannelKind(8, "/end", "End", EndRecord, "what the trial came to, and the learner after it; depths in m")

CHANNELS: Final = (START, TICK, CALL, DECISION, REINFORCEMENT, EVENT, RECORDER, END)
BY_ID: Final = {kind.id: kind for kind in CHANNELS}
BY_TOPIC: Final = {kind.topic: kind for kind in CHANNELS}

MESSAGES: Final[Mapping[str, tuple[tuple[str, str, int], ...]]] = {
    name: _fields_of(record) for name, record in (*SAMPLES.items(), *((kind.message, kind.record) for kind in CHANNELS))
}
"""Field name, kind and number of each message."""


def enum_number(kind: str, member: Any) -> int:
    """The number of a member of an enumeration of the schema."""
    return ENUMS[kind][0].index(member)


def enum_member(kind: str, number: int) -> Any:
    """The member with that number."""
    return ENUMS[kind][0][number]


@cache
def descriptor_set(message: str) -> bytes:
    """The serialised ``FileDescriptorSet`` that an MCAP schema of this message holds: all that readers need."""
    files = descriptor_pb2.FileDescriptorSet()
    files.file.append(_file(message))
    return bytes(files.SerializeToString(deterministic=True))


@cache
def message_class(message: str) -> type[Message]:
    """The class of a message, by protobuf itself."""
    pool = descriptor_pool.DescriptorPool()
    pool.Add(_file(message))
    made: type[Message] = message_factory.GetMessageClass(pool.FindMessageTypeByName(f"{PACKAGE}.{message}"))
    return made


def encode(message: str, **fields: Any) -> bytes:
    """A message by protobuf; None leaves a field out."""
    made: Any = message_class(message)(**{name: value for name, value in fields.items() if value is not None})
    return bytes(made.SerializeToString(deterministic=True))


def _file(message: str) -> descriptor_pb2.FileDescriptorProto:
    """A file with this message and what it refers to. Syntax proto2: presence of every field is kept."""
    file = descriptor_pb2.FileDescriptorProto(name=f"palpate/log/{message}.proto", package=PACKAGE, syntax="proto2")
    wanted, done = [message], []
    while wanted:
        name = wanted.pop(0)
        if name in done:
            continue
        done.append(name)
        if name in ENUMS:
            members, prefix = ENUMS[name]
            enum = file.enum_type.add(name=name)
            for number, member in enumerate(members):
                enum.value.add(name=f"{prefix}{member.name}", number=number)
            continue
        made = file.message_type.add(name=name)
        for field, kind, number in MESSAGES[name]:
            made.field.append(_field(field, kind, number))
            if kind not in _SCALARS and kind != VECTOR:
                wanted.append(kind)
    return file


def _field(name: str, kind: str, number: int) -> descriptor_pb2.FieldDescriptorProto:
    field = descriptor_pb2.FieldDescriptorProto(name=name, number=number, label=_OPTIONAL)
    if kind == VECTOR:
        field.type, field.label = _SCALARS["double"], _REPEATED
        field.options.packed = True
    elif kind in _SCALARS:
        field.type = _SCALARS[kind]
    else:
        field.type = _ENUM if kind in ENUMS else _MESSAGE
        field.type_name = f".{PACKAGE}.{kind}"
    return field
