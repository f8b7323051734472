"""The precompiled tick is, byte for byte, what protobuf makes of it."""

import struct
from dataclasses import replace
from math import isfinite
from types import SimpleNamespace
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.adapters.log import TickRecord, encode_record
from palpate.adapters.log.schema import message_class
from palpate.adapters.log.tick_layout import decode_tick, full_layout, layout_of
from palpate.core.ports.values import AppliedCommand, CommandReason, JointSample, Validity, WrenchKind, WrenchSample
from tests.unit.adapters.log.crafted import tick_record

Draw = Any


def double(bits: int) -> float:
    return float(struct.unpack("<d", struct.pack("<Q", bits))[0])


NAN_WITH_PAYLOAD = double(0xFFF8DEADBEEF1234)
SPECIAL = (0.0, -0.0, 5e-324, 1.7976931348623157e308, double(0x7FF0 << 48), double(0xFFF0 << 48), NAN_WITH_PAYLOAD)
doubles = st.one_of(st.sampled_from(SPECIAL), st.integers(0, 2**64 - 1).map(double))
longs = st.one_of(st.sampled_from((0, -1, 2**63 - 1, -(2**63))), st.integers(-(2**63), 2**63 - 1))
frames = st.text(max_size=40).filter(lambda text: text.isprintable() or not text)


def vectors(size: int) -> st.SearchStrategy[tuple[float, ...]]:
    return st.tuples(*[doubles] * size)


@st.composite
def wrenches(draw: Draw) -> WrenchSample:
    force, torque, validity = draw(vectors(3)), draw(vectors(3)), draw(st.sampled_from(Validity))
    if not isfinite(sum(force) + sum(torque)) or not isfinite(sum(force + torque)):
        validity = Validity.INVALID
    kind = draw(st.sampled_from(WrenchKind))
    return WrenchSample(force, torque, draw(longs), draw(longs), draw(longs), validity, kind, draw(frames))


@st.composite
def joint_samples(draw: Draw) -> JointSample:
    position, validity = draw(st.integers(1, 9).flatmap(vectors)), draw(st.sampled_from(Validity))
    if not isfinite(sum(position)):
        validity = Validity.INVALID
    return JointSample(position, draw(longs), draw(longs), draw(longs), validity)


@st.composite
def applied_commands(draw: Draw) -> AppliedCommand:
    return AppliedCommand(draw(st.integers(1, 9).flatmap(vectors)), draw(st.sampled_from(CommandReason)))


@st.composite
def ticks(draw: Draw) -> TickRecord:
    asked = draw(st.integers(1, 9).flatmap(vectors))
    times = draw(longs), draw(longs), draw(longs)
    return TickRecord(*times, draw(wrenches()), draw(joint_samples()), asked, draw(applied_commands()))


OPTIONAL = ("time_ns", "deadline_ns", "wrench", "joints", "asked_rad", "applied")


@st.composite
def partial_ticks(draw: Draw) -> TickRecord:
    missing = draw(st.sets(st.sampled_from(OPTIONAL)))
    return replace(draw(ticks()), counterfactual=draw(st.booleans()), **dict.fromkeys(missing))


def by_protobuf(record: TickRecord) -> bytes:
    return encode_record("Tick", record)


def packed(tick: TickRecord) -> bytes:
    """As the recorder packs a tick in which everything is there."""
    layout: Any = layout_of(tick)
    snapshot = SimpleNamespace(tick=tick.tick, time_ns=tick.time_ns, wrench=tick.wrench, joints=tick.joints)
    return layout.pack(tick.deadline_ns, snapshot, SimpleNamespace(position_rad=tick.asked_rad), tick.applied)


def bits(record: TickRecord) -> Any:
    """Comparable where floats are not: NaN differs from itself, and -0.0 does not from 0.0."""

    def plain(value: Any) -> Any:
        if isinstance(value, float):
            return struct.pack("<d", value)
        if isinstance(value, tuple):
            return tuple(plain(item) for item in value)
        if hasattr(value, "__slots__"):
            return type(value), tuple(plain(getattr(value, name)) for name in value.__slots__)
        return value

    return plain(record)


@given(ticks())
def test_every_bit_comes_back_either_way(record: TickRecord) -> None:
    payload = packed(record)
    assert payload == by_protobuf(record)
    assert bits(decode_tick(payload)) == bits(record)
    assert bits(decode_tick(payload, layout_of(record))) == bits(record)


@given(partial_ticks())
def test_what_was_missing_is_missing_again(record: TickRecord) -> None:
    payload = by_protobuf(record)
    assert bits(decode_tick(payload)) == bits(record)


@settings(max_examples=40)
@given(partial_ticks(), ticks())
def test_another_layout_does_not_change_what_is_read(record: TickRecord, other: TickRecord) -> None:
    assert bits(decode_tick(by_protobuf(record), layout_of(other))) == bits(record)


@pytest.mark.parametrize("frame", ["", "sensor", "f" * 127, "f" * 128, "f" * 300, "Spitze über Werkstück"])
def test_lengths_beyond_one_byte(frame: str) -> None:
    for joints in range(1, 10):
        record = tick_record(3, joints)
        assert record.wrench is not None
        record = replace(record, wrench=replace(record.wrench, frame=frame))
        payload = packed(record)
        assert payload == by_protobuf(record)
        assert decode_tick(payload, layout_of(record)) == record


def test_an_unknown_enumeration_number_is_no_reading() -> None:
    # Protobuf hides a number that it does not know, and its default would be VALID.
    record = tick_record(3)
    payload, layout = packed(record), layout_of(record)
    marks = {"validity": b"\x30\x00\x38\x00", "kind": b"\x38\x00\x42", "reason": b"\x40\x00"}
    for name, mark in marks.items():
        for unknown in (4, 77, 127):
            at = payload.rindex(mark)
            broken = payload[: at + 1] + bytes([unknown]) + payload[at + 2 :]
            for way in (None, layout):
                with pytest.raises(ValueError, match=name):
                    decode_tick(broken, way)


@pytest.mark.parametrize("way", ["fast", "protobuf"])
def test_a_sample_that_is_not_finite_and_not_marked_so_is_refused(way: str) -> None:
    record = tick_record(3)
    layout = full_layout(6, 6, 6, "sensor")
    payload = packed(record).replace(struct.pack("<d", -5.0), struct.pack("<d", float("nan")))
    with pytest.raises(ValueError, match="INVALID"):
        decode_tick(payload, layout if way == "fast" else None)


@pytest.mark.parametrize("field", ["tick", "validity", "kind", "frame", "sequence", "force_N", "reason"])
def test_a_message_without_a_field_that_must_be_there_is_refused(field: str) -> None:
    made: Any = message_class("Tick").FromString(packed(tick_record(3)))
    (made if field in ("tick", "reason") else made.wrench).ClearField(field)
    with pytest.raises(ValueError, match=r"is missing|unpack"):
        decode_tick(made.SerializeToString())


@given(st.integers(0, 8 * full_layout(6, 6, 6, "sensor").size - 1))
def test_a_flipped_bit_is_read_alike_both_ways_or_refused_both_ways(bit: int) -> None:
    payload = bytearray(packed(tick_record(3)))
    payload[bit // 8] ^= 1 << bit % 8
    results = []
    for layout in (None, full_layout(6, 6, 6, "sensor")):
        try:
            results.append(bits(decode_tick(bytes(payload), layout)))
        except Exception as error:
            results.append(type(error))
    assert results[0] == results[1]
