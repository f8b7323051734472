"""Channels in a trial's log, and the protobuf classes for their messages (``log.proto``)."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from typing import Any, Final

from google.protobuf import descriptor_pb2

from palpate.adapters.log import log_pb2, records
from palpate.core.ports import CommandReason, Validity, WrenchKind

PACKAGE: Final = "palpate.log"
SCHEMA: Final = "palpate.log/4"
"""Version of the format. A changed field or meaning requires a new version; logs in other formats are rejected."""

VALIDITIES: Final = (Validity.VALID, Validity.SATURATED, Validity.STALE, Validity.INVALID)
KINDS: Final = (WrenchKind.RAW, WrenchKind.TARED, WrenchKind.GRAVITY_COMPENSATED)
REASONS: Final = (
    CommandReason.AS_REQUESTED,
    CommandReason.POSITION_LIMIT,
    CommandReason.VELOCITY_LIMIT,
    CommandReason.STOPPED,
)
"""Enumeration members in the order of their numbers."""


@dataclass(frozen=True)
class ChannelKind:
    """A log channel: message in ``log.proto``, record class, and a one-line description with units and frames."""

    id: int
    message: str
    record: type
    about: str

    @property
    def topic(self) -> str:
        """Channel name."""
        return f"/{self.message.lower()}"


_TICKS: Final = (
    "one message per control tick: samples, requested and applied command. Wrench: exerted on the tool, in the frame"
    " it names, N and N m; joints in rad; times in ns of the run's clock"
)
_CALLS: Final = "port calls in addition to those of each tick: reads, stop, errors"
_DECISIONS: Final = "symbol, state and chosen action, its displacement in m"
_EARNED: Final = "reinforcement of the decision with this number"

START = ChannelKind(1, "Start", records.StartRecord, "initial state of the trial; lengths in m in the task frame")
TICK = ChannelKind(2, "Tick", records.TickRecord, _TICKS)
CALL = ChannelKind(3, "Call", records.CallEntry, _CALLS)
DECISION = ChannelKind(4, "Decision", records.DecisionEntry, _DECISIONS)
REINFORCEMENT = ChannelKind(5, "Reinforcement", records.ReinforcementEntry, _EARNED)
EVENT = ChannelKind(6, "Event", records.EventEntry, "contact, tare, phases, hole, faults, end")
RECORDER = ChannelKind(7, "Recorder", records.LossEntry, "losses of the recorder, with their reasons")
END = ChannelKind(8, "End", records.EndRecord, "outcome of the trial, and the learner after it; depths in m")

CHANNELS: Final = (START, TICK, CALL, DECISION, REINFORCEMENT, EVENT, RECORDER, END)
BY_ID: Final = {kind.id: kind for kind in CHANNELS}
BY_TOPIC: Final = {kind.topic: kind for kind in CHANNELS}
BY_RECORD: Final = {kind.record: kind for kind in CHANNELS}


def message_class(message: str) -> Any:
    """Return the protobuf class for a message."""
    return getattr(log_pb2, message)


@cache
def descriptor_set(message: str) -> bytes:
    """Return the serialised ``FileDescriptorSet`` for a message and its dependencies, as MCAP schemas store it."""
    file = descriptor_pb2.FileDescriptorProto()
    log_pb2.DESCRIPTOR.CopyToProto(file)
    needed = set(_referred(message_class(message).DESCRIPTOR))
    for kinds in (file.message_type, file.enum_type):
        for kind in [each for each in kinds if each.name not in needed]:
            kinds.remove(kind)
    return bytes(descriptor_pb2.FileDescriptorSet(file=[file]).SerializeToString(deterministic=True))


def _referred(message: Any) -> Iterator[str]:
    yield message.name
    for field in message.fields:
        if field.message_type is not None:
            yield from _referred(field.message_type)
        if field.enum_type is not None:
            yield field.enum_type.name
