"""Records to and from protobuf bytes. Ticks have functions of their own, because each tick of a loop needs one."""

import dataclasses
from functools import cache
from typing import Any, Final, TypeVar

from palpate.adapters.log.records import TickRecord
from palpate.adapters.log.schema import KINDS, REASONS, VALIDITIES, message_class
from palpate.core.ports import AppliedCommand, JointCommand, JointSample, Snapshot, WrenchSample

R = TypeVar("R")
_TICK: Final = message_class("Tick")
_WRENCH: Final = message_class("Wrench")
_JOINTS: Final = message_class("Joints")
# Most samples and commands are these, and to look up a member of an enumeration takes longer.
_VALID, _RAW, _AS_ASKED = VALIDITIES[0], KINDS[0], REASONS[0]
_VALIDITY: Final = {member: number for number, member in enumerate(VALIDITIES)}
_KIND: Final = {member: number for number, member in enumerate(KINDS)}
_REASON: Final = {member: number for number, member in enumerate(REASONS)}


def encode_record(message: str, record: Any) -> bytes:
    """The record as protobuf bytes. Defaults of optional text, flags and whole numbers are left out.

    Raises:
        ValueError: A value does not fit the message; so do TypeError and OverflowError.
    """
    fields: dict[str, Any] = {}
    kind: Any = type(record)
    for name, default in _fields(kind):
        value = getattr(record, name)
        if isinstance(value, AppliedCommand):
            fields |= {"applied_rad": value.position_rad, "reason": _REASON[value.reason]}
        elif isinstance(value, WrenchSample):
            fields[name] = _wrench_message(value)
        elif isinstance(value, JointSample):
            fields[name] = _joints_message(value)
        # A float is equal to its default and still another one: -0.0.
        elif value is not None and (isinstance(value, float) or value != default):
            fields[name] = value
    return bytes(message_class(message)(**fields).SerializeToString(deterministic=True))


def decode_record(message: str, kind: type[R], payload: bytes) -> R:
    """The record back from its bytes.

    Raises:
        ValueError: A field without a default is missing; protobuf's DecodeError for bytes that are no message.
    """
    made: Any = message_class(message).FromString(payload)
    fields: dict[str, Any] = {}
    any_kind: Any = kind
    for name, default in _fields(any_kind):
        if name == "applied":
            fields[name] = _applied(made)
        elif name == "wrench":
            fields[name] = _wrench(made.wrench) if made.HasField(name) else None
        elif name == "joints":
            fields[name] = _joints(made.joints) if made.HasField(name) else None
        elif made.DESCRIPTOR.fields_by_name[name].is_repeated:
            # A packed vector that is empty is not on the wire: then the default, if there is one.
            if values := tuple(getattr(made, name)):
                fields[name] = values
        elif made.HasField(name):
            fields[name] = value = getattr(made, name)
            # Protobuf hands text over as bytes if it is not UTF-8.
            if isinstance(value, bytes):
                raise ValueError(f"{name} is no text")
        elif default is dataclasses.MISSING:
            raise ValueError(f"{name} is missing")
    return kind(**fields)


def encode_tick(deadline_ns: int, snapshot: Snapshot, command: JointCommand, applied: AppliedCommand) -> bytes:
    """A whole tick as protobuf bytes; errors as of :func:`encode_record`."""
    message = _TICK(
        tick=snapshot.tick,
        time_ns=snapshot.time_ns,
        deadline_ns=deadline_ns,
        wrench=_wrench_message(snapshot.wrench),
        joints=_joints_message(snapshot.joints),
        asked_rad=command.position_rad,
        applied_rad=applied.position_rad,
        reason=0 if applied.reason is _AS_ASKED else _REASON[applied.reason],
    )
    return message.SerializeToString()  # type: ignore[no-any-return]


def decode_tick(payload: bytes) -> TickRecord:
    """The tick back from its bytes; errors as of :func:`decode_record`, and CommandError for a false sample."""
    made = _TICK.FromString(payload)
    has = made.HasField
    if not has("tick"):
        raise ValueError("tick is missing")
    return TickRecord(
        made.tick,
        made.time_ns if has("time_ns") else None,
        made.deadline_ns if has("deadline_ns") else None,
        _wrench(made.wrench) if has("wrench") else None,
        _joints(made.joints) if has("joints") else None,
        tuple(made.asked_rad[:]) or None,
        _applied(made),
        made.counterfactual,
    )


@cache
def _fields(record: Any) -> tuple[tuple[str, Any], ...]:
    return tuple((field.name, field.default) for field in dataclasses.fields(record))


def _wrench_message(sample: WrenchSample) -> Any:
    return _WRENCH(
        force_N=sample.force_N,
        torque_Nm=sample.torque_Nm,
        source_time_ns=sample.source_time_ns,
        receive_time_ns=sample.receive_time_ns,
        sequence=sample.sequence,
        validity=0 if sample.validity is _VALID else _VALIDITY[sample.validity],
        kind=0 if sample.kind is _RAW else _KIND[sample.kind],
        frame=sample.frame,
    )


def _joints_message(sample: JointSample) -> Any:
    return _JOINTS(
        position_rad=sample.position_rad,
        source_time_ns=sample.source_time_ns,
        receive_time_ns=sample.receive_time_ns,
        sequence=sample.sequence,
        validity=0 if sample.validity is _VALID else _VALIDITY[sample.validity],
    )


def _wrench(made: Any) -> WrenchSample:
    # An unknown number of an enumeration counts as not there.
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
    """The applied command in a message that may hold one: not one field of it, but two."""
    if made.HasField("reason"):
        return AppliedCommand(tuple(made.applied_rad[:]), REASONS[made.reason])
    if len(made.applied_rad):
        raise ValueError("the applied command's reason is missing, or unknown")
    return None
