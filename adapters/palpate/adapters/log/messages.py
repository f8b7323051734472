"""Convert records to and from protobuf bytes. Ticks have their own functions for speed."""

import dataclasses
from collections.abc import Callable
from functools import cache
from typing import Any, Final, TypeVar

from palpate.adapters.log.records import TickRecord
from palpate.adapters.log.schema import BY_RECORD, KINDS, REASONS, VALIDITIES, message_class
from palpate.core.ports import AppliedCommand, JointSample, WrenchSample

R = TypeVar("R")
_TICK: Final = message_class("Tick")
_WRENCH: Final = message_class("Wrench")
_JOINTS: Final = message_class("Joints")
_VALIDITY: Final = {member: number for number, member in enumerate(VALIDITIES)}
_KIND: Final = {member: number for number, member in enumerate(KINDS)}
_REASON: Final = {member: number for number, member in enumerate(REASONS)}


def encode(record: Any) -> bytes:
    """Encode a record as protobuf bytes. Default values of optional strings, flags and integers are omitted.

    Raises:
        ValueError: A value does not fit the message; TypeError and OverflowError are also possible.
    """
    message = _tick_message(record) if isinstance(record, TickRecord) else _message(record)
    return bytes(message.SerializeToString(deterministic=True))


def decode(kind: Callable[..., R], payload: bytes) -> R:
    """Decode a record; unknown fields are ignored.

    Raises:
        ValueError: A string is invalid, or a sample has no validity. A missing field raises TypeError, invalid bytes
            raise protobuf's DecodeError, and an invalid sample raises CommandError.
    """
    any_kind: Any = kind
    record: Any = _tick(payload) if any_kind is TickRecord else _record(any_kind, payload)
    return record  # type: ignore[no-any-return]


@cache
def _fields(kind: Any) -> dict[str, Any]:
    """Return the names and defaults of the fields."""
    return {each.name: each.default for each in dataclasses.fields(kind)}


def _message(record: Any) -> Any:
    kind: Any = type(record)
    fields = {name: getattr(record, name) for name in _fields(kind)}
    # A float may equal its default and still differ: -0.0.
    fields = {
        name: value
        for name, value in fields.items()
        if value is not None and (isinstance(value, float) or value != _fields(kind)[name])
    }
    return message_class(BY_RECORD[kind].message)(**fields)


def _record(kind: Any, payload: bytes) -> Any:
    made = message_class(BY_RECORD[kind].message).FromString(payload)
    fields: dict[str, Any] = {}
    for descriptor, value in made.ListFields():
        if isinstance(value, bytes):
            # Protobuf returns text as bytes if it is not UTF-8.
            raise ValueError(f"{descriptor.name} is no text")
        if descriptor.name in _fields(kind):
            fields[descriptor.name] = tuple(value) if descriptor.is_repeated else value
    return kind(**fields)


def _tick_message(record: TickRecord) -> Any:
    wrench, joints, applied = record.wrench, record.joints, record.applied
    return _TICK(
        tick=record.tick,
        time_ns=record.time_ns,
        deadline_ns=record.deadline_ns,
        wrench=wrench
        and _WRENCH(
            force_N=wrench.force_N,
            torque_Nm=wrench.torque_Nm,
            source_time_ns=wrench.source_time_ns,
            receive_time_ns=wrench.receive_time_ns,
            sequence=wrench.sequence,
            validity=_VALIDITY[wrench.validity],
            kind=_KIND[wrench.kind],
            frame=wrench.frame,
        ),
        joints=joints
        and _JOINTS(
            position_rad=joints.position_rad,
            source_time_ns=joints.source_time_ns,
            receive_time_ns=joints.receive_time_ns,
            sequence=joints.sequence,
            validity=_VALIDITY[joints.validity],
        ),
        requested_rad=record.requested_rad,
        applied_rad=applied and applied.position_rad,
        reason=applied and _REASON[applied.reason],
        counterfactual=record.counterfactual or None,
    )


def _tick(payload: bytes) -> TickRecord:
    made = _TICK.FromString(payload)
    has = made.HasField
    if not has("tick"):
        raise TypeError("tick is missing")
    return TickRecord(
        made.tick,
        made.time_ns if has("time_ns") else None,
        made.deadline_ns if has("deadline_ns") else None,
        _wrench(made.wrench) if has("wrench") else None,
        _joints(made.joints) if has("joints") else None,
        tuple(made.requested_rad[:]) or None,
        _applied(made),
        made.counterfactual,
    )


def _wrench(made: Any) -> WrenchSample:
    # An unknown enumeration value counts as missing.
    if not made.HasField("validity") or not made.HasField("kind"):
        raise ValueError("the wrench's validity or kind is missing, or unknown")
    return WrenchSample(
        tuple(made.force_N[:]),
        tuple(made.torque_Nm[:]),
        made.source_time_ns,
        made.receive_time_ns,
        made.sequence,
        VALIDITIES[made.validity],
        KINDS[made.kind],
        made.frame,
    )


def _joints(made: Any) -> JointSample:
    if not made.HasField("validity"):
        raise ValueError("the joints' validity is missing, or unknown")
    return JointSample(
        tuple(made.position_rad[:]),
        made.source_time_ns,
        made.receive_time_ns,
        made.sequence,
        VALIDITIES[made.validity],
    )


def _applied(made: Any) -> AppliedCommand | None:
    """Return the applied command in a message, which is stored in two fields."""
    if made.HasField("reason"):
        return AppliedCommand(tuple(made.applied_rad[:]), REASONS[made.reason])
    if len(made.applied_rad):
        raise ValueError("the applied command's reason is missing, or unknown")
    return None
