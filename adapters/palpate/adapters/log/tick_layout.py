"""The tick message as one precompiled ``struct``: written and read many times faster than by protobuf itself.

Possible because every field of it has a fixed width, so that the bytes between the numbers (tags, lengths, the name
of the frame) are constant for a given arm, sensor and set of fields that are there. Protobuf is the oracle in the
tests, and the fallback for a message of ours that has another layout.
"""

from __future__ import annotations

import struct
from collections.abc import Mapping
from functools import lru_cache
from typing import Final

from palpate.adapters.log.messages import decode_record
from palpate.adapters.log.records import TickRecord
from palpate.adapters.log.schema import ENUMS, MESSAGES, VECTOR, enum_number
from palpate.core.errors import CommandError
from palpate.core.ports import (
    AppliedCommand,
    CommandReason,
    JointCommand,
    JointSample,
    Snapshot,
    Validity,
    WrenchKind,
    WrenchSample,
)

_VARINT, _FIXED64, _BYTES = 0, 1, 2
# Members of an enumeration are looked up more slowly.
_VALID, _RAW, _AS_ASKED = Validity.VALID, WrenchKind.RAW, CommandReason.AS_ASKED


def decode_tick(payload: bytes, layout: FullLayout | None = None) -> TickRecord:
    """The tick back from its bytes.

    Args:
        layout: The layout that most ticks of the log have; the result does not depend on it.
    """
    record = None if layout is None else layout.unpack(payload)
    return decode_record("Tick", TickRecord, payload) if record is None else record


def layout_of(record: TickRecord) -> FullLayout | None:
    """The layout that a tick like this one has; None when something is missing in it."""
    wrench, joints, asked, applied = record.wrench, record.joints, record.asked_rad, record.applied
    if wrench is None or joints is None or asked is None or applied is None:
        return None
    return full_layout(len(asked), len(joints.position_rad), len(applied.position_rad), wrench.frame)


class FullLayout:
    """The layout of a tick in which everything is there. Immutable."""

    def __init__(self, asked: int, joints: int, applied: int, frame: str) -> None:
        lengths = {"force_N": 3, "torque_Nm": 3, "position_rad": joints, "asked_rad": asked, "applied_rad": applied}
        tick = _Segments("Tick", lengths, frame.encode())
        self._frame = frame
        self._packer, self._constants = tick.packer()
        self._reader = tick.reader()
        self._mask, self._template = tick.mask()
        self.size = self._packer.size
        self._joints_end = _JOINTS_AT + joints
        self._asked_at = self._joints_end + 4
        self._applied_at = self._asked_at + asked
        self._reason_at = self._applied_at + applied

    def pack(self, deadline_ns: int, snapshot: Snapshot, command: JointCommand, applied: AppliedCommand) -> bytes:
        """The message's bytes."""
        wrench, joints, reason = snapshot.wrench, snapshot.joints, applied.reason
        validity, kind, trust = wrench.validity, wrench.kind, joints.validity
        k = self._constants
        # The order of the arguments is that of the segments; identity first, because hashing an enum member is slow.
        return self._packer.pack(
            k[0], snapshot.tick, k[1], snapshot.time_ns, k[2], deadline_ns,
            k[3], *wrench.force_N, k[4], *wrench.torque_Nm,
            k[5], wrench.source_time_ns, k[6], wrench.receive_time_ns, k[7], wrench.sequence,
            k[8], 0 if validity is _VALID else enum_number("Validity", validity),
            k[9], 0 if kind is _RAW else enum_number("Kind", kind),
            k[10], *joints.position_rad,
            k[11], joints.source_time_ns, k[12], joints.receive_time_ns, k[13], joints.sequence,
            k[14], 0 if trust is _VALID else enum_number("Validity", trust),
            k[15], *command.position_rad, k[16], *applied.position_rad,
            k[17], 0 if reason is _AS_ASKED else enum_number("Reason", reason),
        )  # fmt: skip

    def unpack(self, payload: bytes) -> TickRecord | None:
        """The tick; None when the message has another layout."""
        if len(payload) != self.size or int.from_bytes(payload, "little") & self._mask != self._template:
            return None
        v = self._reader.unpack(payload)
        end, asked_at, applied_at, reason_at = self._joints_end, self._asked_at, self._applied_at, self._reason_at
        try:
            return TickRecord(
                v[0],
                v[1],
                v[2],
                WrenchSample(v[3:6], v[6:9], v[9], v[10], v[11], _VALIDITY[v[12]], _KIND[v[13]], self._frame),
                JointSample(v[_JOINTS_AT:end], v[end], v[end + 1], v[end + 2], _VALIDITY[v[end + 3]]),
                v[asked_at:applied_at],
                AppliedCommand(v[applied_at:reason_at], _REASON[v[reason_at]]),
            )
        except (IndexError, CommandError):
            # No such member, or not finite and yet not marked so: protobuf's way tells what is wrong.
            return None


_JOINTS_AT: Final = 14
"""Place of the first joint angle among the numbers of a tick: three times, twelve of the wrench less the frame."""
_VALIDITY: Final = ENUMS["Validity"][0]
_KIND: Final = ENUMS["Kind"][0]
_REASON: Final = ENUMS["Reason"][0]


@lru_cache(maxsize=64)
def full_layout(asked: int, joints: int, applied: int, frame: str) -> FullLayout:
    """The layout for these sizes, made once."""
    return FullLayout(asked, joints, applied, frame)


class _Segments:
    """A message as constant bytes and numbers in turns; numbers are ``(struct code, count)``."""

    def __init__(self, message: str, lengths: Mapping[str, int], frame: bytes) -> None:
        self._parts: list[tuple[bytes, str, int]] = []
        self._tail = b""
        for name, kind, number in MESSAGES[message]:
            if kind == VECTOR:
                self._tail += _tag(number, _BYTES) + _varint(8 * lengths[name])
                self._number("d", lengths[name])
            elif kind == "sfixed64":
                self._tail += _tag(number, _FIXED64)
                self._number("q")
            elif kind in ENUMS:
                # A varint below 128 is one byte.
                self._tail += _tag(number, _VARINT)
                self._number("B")
            elif kind == "string":
                self._tail += _tag(number, _BYTES) + _varint(len(frame)) + frame
            elif kind in MESSAGES:
                inner = _Segments(kind, lengths, frame)
                self._tail += _tag(number, _BYTES) + _varint(inner._size())
                for constant, code, count in inner._parts:
                    self._tail += constant
                    self._number(code, count)
                self._tail += inner._tail

    def packer(self) -> tuple[struct.Struct, tuple[bytes, ...]]:
        """Takes constant, numbers, constant, numbers, ... and the constants."""
        codes = "".join(f"{len(constant)}s{count}{code}" for constant, code, count in self._parts)
        return struct.Struct(f"<{codes}"), tuple(constant for constant, _, _ in self._parts)

    def reader(self) -> struct.Struct:
        """Gives the numbers alone."""
        return struct.Struct("<" + "".join(f"{len(constant)}x{count}{code}" for constant, code, count in self._parts))

    def mask(self) -> tuple[int, int]:
        """Ones where bytes are constant, and what they are; both as one number, little-endian."""
        mask = template = b""
        for constant, code, count in self._parts:
            numbers = struct.calcsize(f"<{count}{code}")
            mask += b"\xff" * len(constant) + bytes(numbers)
            template += constant + bytes(numbers)
        return int.from_bytes(mask, "little"), int.from_bytes(template, "little")

    def _number(self, code: str, count: int = 1) -> None:
        self._parts.append((self._tail, code, count))
        self._tail = b""

    def _size(self) -> int:
        numbers = sum(len(c) + struct.calcsize(f"<{count}{code}") for c, code, count in self._parts)
        return numbers + len(self._tail)


def _tag(number: int, wire: int) -> bytes:
    return _varint(number << 3 | wire)


def _varint(value: int) -> bytes:
    encoded = bytearray()
    while value > 0x7F:
        encoded.append(value & 0x7F | 0x80)
        value >>= 7
    encoded.append(value)
    return bytes(encoded)
