"""Records to and from protobuf bytes."""

import dataclasses
from collections.abc import Callable
from enum import Enum
from functools import cache
from typing import Any, Final, TypeVar

from palpate.adapters.log.schema import BY_RECORD, KINDS, REASONS, VALIDITIES, message_class
from palpate.core.ports import AppliedCommand, JointSample, WrenchSample

R = TypeVar("R")
_SAMPLES: Final = {WrenchSample: "Wrench", JointSample: "Joints"}
_NUMBERS: Final = {member: place for members in (VALIDITIES, KINDS, REASONS) for place, member in enumerate(members)}
_MEMBERS: Final = {"validity": VALIDITIES, "kind": KINDS}


def encode(record: Any) -> bytes:
    """The record as protobuf bytes. Defaults of optional text, flags and whole numbers are left out.

    Raises:
        ValueError: A value does not fit the message; so do TypeError and OverflowError.
    """
    return bytes(_message(record).SerializeToString(deterministic=True))


def decode(kind: Callable[..., R], payload: bytes) -> R:
    """The record back from its bytes; a field that the record does not have is passed over.

    Raises:
        ValueError: A value is no text, or a sample lacks its validity; TypeError for a missing field, protobuf's
            DecodeError for bytes that are no message, and CommandError for a false sample.
    """
    record: R = _record(kind, _class_of(kind).FromString(payload))
    return record


@cache
def _class_of(kind: Any) -> Any:
    return message_class(_SAMPLES[kind] if kind in _SAMPLES else BY_RECORD[kind].message)


@cache
def _fields(kind: Any) -> dict[str, Any]:
    """Names, and the values that need not be written; a sample says all."""
    return {each.name: dataclasses.MISSING if kind in _SAMPLES else each.default for each in dataclasses.fields(kind)}


def _message(record: Any) -> Any:
    kind: Any = type(record)
    fields: dict[str, Any] = {}
    for name, default in _fields(kind).items():
        value = getattr(record, name)
        if isinstance(value, AppliedCommand):
            fields["applied_rad"], fields["reason"] = value.position_rad, _NUMBERS[value.reason]
        elif isinstance(value, (WrenchSample, JointSample)):
            fields[name] = _message(value)
        elif isinstance(value, Enum):
            fields[name] = _NUMBERS[value]
        # A float is equal to its default and still another one: -0.0.
        elif value is not None and (isinstance(value, float) or value != default):
            fields[name] = value
    return _class_of(kind)(**fields)


def _record(kind: Any, made: Any) -> Any:
    fields: dict[str, Any] = {}
    names = _fields(kind)
    # Of an enumeration's number that is unknown nothing is listed.
    for descriptor, value in made.ListFields():
        name = descriptor.name
        if name not in names:
            continue
        if name == "wrench":
            value = _record(WrenchSample, value)
        elif name == "joints":
            value = _record(JointSample, value)
        elif name in _MEMBERS:
            value = _MEMBERS[name][value]
        elif descriptor.is_repeated:
            value = tuple(value)
        elif isinstance(value, bytes):
            # Protobuf hands text over as bytes if it is not UTF-8.
            raise ValueError(f"{name} is no text")
        fields[name] = value
    if "applied" in names:
        fields["applied"] = _applied(made)
    if kind in _SAMPLES and not _MEMBERS.keys() & names.keys() <= fields.keys():
        raise ValueError("the sample's validity or kind is missing, or unknown")
    return kind(**fields)


def _applied(made: Any) -> AppliedCommand | None:
    """The applied command in a message that may hold one: not one field of it, but two."""
    if made.HasField("reason"):
        return AppliedCommand(tuple(made.applied_rad), REASONS[made.reason])
    if made.applied_rad:
        raise ValueError("the applied command's reason is missing, or unknown")
    return None
