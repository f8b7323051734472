"""Replies: ``status | items | sum``, without header or address; only the mask determines the length. FACT: libnmc.

The sum is weak: it detects every single corrupted byte, but misses 1 in 256 arbitrary corruptions, and a stuck line
that reads as zeros has a valid sum. Therefore replies of zeros are also discarded, and code that uses a position
should check whether the motor could have reached it (CALC).
"""

import enum
import struct
from dataclasses import dataclass
from typing import Final

from palpate.drivers.nmc.frames import Aux, NmcStatus, StatusItem, checksum

REPLY_OVERHEAD_BYTES: Final = 2

SERVO: Final = 0
"""Type code for a module that drives a motor."""
_LAYOUT: Final = (
    (StatusItem.POSITION, "i", "position_counts"),
    (StatusItem.ANALOG, "x", ""),
    (StatusItem.VELOCITY, "2x", ""),
    (StatusItem.AUX, "B", "aux"),
    (StatusItem.HOME, "4x", ""),
    (StatusItem.IDENTITY, "2s", "identity"),
    (StatusItem.POSITION_ERROR, "2x", ""),
    (StatusItem.PATH_POINTS, "x", ""),
)
"""Status items in order; those without a name are ignored."""


class Discarded(enum.Enum):
    """Reason for discarding a reply."""

    MISSING = "no reply in time"
    LATE = "a reply that may belong to an earlier request"
    TOGETHER = "two replies at once, of which one was kept back"
    SHORT = "reply cut short"
    CHECKSUM = "wrong checksum"
    BLANK = "nothing but zeros, as from a stuck line"
    REJECTED = "the module received a damaged command"
    ECHO = "the command itself came back"
    ANOTHER = "a position that it cannot have reached, as in another module's reply"


@dataclass(frozen=True, slots=True)
class ModuleIdentity:
    """Type and version of a module."""

    type_code: int
    version: int

    @property
    def name(self) -> str:
        """Type and version as text."""
        kind = "servo" if self.type_code == SERVO else f"type {self.type_code}"
        return f"{kind}, firmware {self.version}"


@dataclass(frozen=True, slots=True)
class Reply:
    """An accepted reply; items that are not in the mask are None."""

    status: NmcStatus
    position_counts: int | None = None
    aux: Aux | None = None
    identity: ModuleIdentity | None = None


def _items(mask: int) -> tuple[struct.Struct, tuple[str, ...]]:
    named = [(layout, name) for item, layout, name in _LAYOUT if int(item) & mask]
    return struct.Struct("<" + "".join(layout for layout, _ in named)), tuple(name for _, name in named if name)


_ITEMS: Final = tuple(_items(mask) for mask in range(256))


def reply_size_bytes(mask: StatusItem) -> int:
    """Return the number of bytes in a reply with these items, including status and sum."""
    return REPLY_OVERHEAD_BYTES + _ITEMS[mask][0].size


def decode_reply(raw: bytes, mask: StatusItem) -> Reply | Discarded:
    """Return the decoded reply, or the reason for discarding it; never raises."""
    size = reply_size_bytes(mask)
    if not raw:
        return Discarded.MISSING
    if len(raw) < size:
        return Discarded.SHORT
    if checksum(raw[: size - 1]) != raw[size - 1]:
        return Discarded.CHECKSUM
    if not any(raw[:size]):
        return Discarded.BLANK
    status = NmcStatus(raw[0])
    if status & NmcStatus.CKSUM_ERROR:
        return Discarded.REJECTED
    return _accepted(status, raw[1 : size - 1], mask)


def _accepted(status: NmcStatus, items: bytes, mask: StatusItem) -> Reply:
    layout, names = _ITEMS[mask]
    found = dict(zip(names, layout.unpack(items), strict=True))
    if "aux" in found:
        found["aux"] = Aux(found["aux"])
    if "identity" in found:
        found["identity"] = ModuleIdentity(*found["identity"])
    return Reply(status=status, **found)
