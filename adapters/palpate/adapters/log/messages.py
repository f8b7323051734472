"""Records to and from protobuf bytes, by protobuf itself; :mod:`.tick_layout` is faster with most ticks."""

import dataclasses
from typing import Any, TypeVar

from palpate.adapters.log.schema import (
    ENUMS,
    MESSAGES,
    SAMPLES,
    VECTOR,
    encode,
    enum_member,
    enum_number,
    message_class,
)
from palpate.core.ports import AppliedCommand, JointSample, WrenchSample

R = TypeVar("R")


def encode_record(message: str, record: Any) -> bytes:
    """The record as protobuf bytes. Defaults of optional text, flags and whole numbers are left out."""
    kinds = {name: kind for name, kind, _ in MESSAGES[message]}
    fields: dict[str, Any] = {}
    for field in dataclasses.fields(record):
        value = getattr(record, field.name)
        if isinstance(value, AppliedCommand):
            fields |= {"applied_rad": value.position_rad, "reason": enum_number("Reason", value.reason)}
        elif isinstance(value, (WrenchSample, JointSample)):
            fields[field.name] = _sample_fields(kinds[field.name], value)
        # A float is equal to its default and still another one: -0.0.
        elif value is not None and (isinstance(value, float) or value != field.default):
            fields[field.name] = value
    return encode(message, **fields)


def decode_record(message: str, kind: type[R], payload: bytes) -> R:
    """The record back from its bytes."""
    made: Any = message_class(message)()
    made.ParseFromString(payload)
    _require_texts(made, message)
    kinds = {name: field_kind for name, field_kind, _ in MESSAGES[message]}
    fields: dict[str, Any] = {}
    for field in dataclasses.fields(kind):  # type: ignore[arg-type]
        name, field_kind = field.name, kinds.get(field.name)
        if field_kind is None:
            fields[name] = _applied(made)
        elif field_kind == VECTOR:
            # A packed vector that is empty is not on the wire: then the default, if there is one.
            if values := tuple(getattr(made, name)):
                fields[name] = values
        elif made.HasField(name):
            value = getattr(made, name)
            fields[name] = _sample(field_kind, value) if field_kind in SAMPLES else value
        elif field.default is dataclasses.MISSING:
            _require_fields(made, name)
    return kind(**fields)


def _sample_fields(message: str, sample: WrenchSample | JointSample) -> dict[str, Any]:
    values = {name: (kind, getattr(sample, name)) for name, kind, _ in MESSAGES[message]}
    return {name: enum_number(kind, value) if kind in ENUMS else value for name, (kind, value) in values.items()}


def _sample(message: str, made: Any) -> Any:
    """The sample in a message; its fields have the order of the sample's own."""
    _require_fields(made, *(name for name, kind, _ in MESSAGES[message] if kind != VECTOR))
    _require_texts(made, message)
    values = []
    for name, kind, _ in MESSAGES[message]:
        value = getattr(made, name)
        values.append(tuple(value) if kind == VECTOR else enum_member(kind, value) if kind in ENUMS else value)
    return SAMPLES[message](*values)


def _applied(made: Any) -> AppliedCommand | None:
    """The applied command in a message that may hold one: not one field of it, but two."""
    if not made.HasField("reason") and not made.applied_rad:
        return None
    _require_fields(made, "reason")
    return AppliedCommand(tuple(made.applied_rad), enum_member("Reason", made.reason))


def _require_fields(made: Any, *names: str) -> None:
    """Refuse a message without these fields. An unknown number of an enumeration counts as not there."""
    for name in names:
        if not made.HasField(name):
            raise ValueError(f"{name} is missing, or is none that is known")


def _require_texts(made: Any, message: str) -> None:
    """Refuse a message with text that is no UTF-8; protobuf would hand it over as bytes."""
    for name, kind, _ in MESSAGES[message]:
        if kind == "string" and isinstance(getattr(made, name), bytes):
            raise ValueError(f"{name} is no text")
