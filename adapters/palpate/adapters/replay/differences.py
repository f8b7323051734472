"""Differences between a replay and its recording, and the numeric tolerance."""

import struct
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, Final


@dataclass(frozen=True, slots=True)
class Difference:
    """A core output that differs from the recorded one."""

    tick: int
    channel: str
    field: str
    recorded: object
    replayed: object

    def __str__(self) -> str:
        return f"tick {self.tick}, {self.channel} {self.field}: recorded {self.recorded}, replayed {self.replayed}"


class Differences:
    """Differences found in a replay, including the first and the first beyond the least significant bits."""

    def __init__(self) -> None:
        self.first_command_tick: int | None = None
        self.first: Difference | None = None
        self.first_gross: Difference | None = None
        self.count = 0

    def compare(self, tick: int, channel: str, field: str, recorded: Any, replayed: Any, *, gross: bool = True) -> None:
        """Compare values, number by number. ``gross`` marks text that must match on any processor."""
        if isinstance(recorded, dict) and isinstance(replayed, dict) and recorded.keys() == replayed.keys():
            for key in recorded:
                self.compare(tick, channel, f"{field}.{key}", recorded[key], replayed[key])
        elif (
            isinstance(recorded, (list, tuple))
            and isinstance(replayed, (list, tuple))
            and len(recorded) == len(replayed)
        ):
            for index, (a, b) in enumerate(zip(recorded, replayed, strict=True)):
                self.compare(tick, channel, f"{field}[{index}]", a, b)
        elif isinstance(recorded, float) and isinstance(replayed, float):
            if not same_bits((recorded,), (replayed,)):
                self.add(tick, channel, field, recorded, replayed, gross=not close_enough(recorded, replayed))
        elif recorded != replayed:
            self.add(tick, channel, field, recorded, replayed, gross=gross)

    def add(
        self, tick: int, channel: str, field: str, recorded: object, replayed: object, *, gross: bool = True
    ) -> None:
        """Add a difference."""
        difference = Difference(tick, channel, field, recorded, replayed)
        self.count += 1
        if self.first is None or difference.tick < self.first.tick:
            self.first = difference
        if gross and (self.first_gross is None or difference.tick < self.first_gross.tick):
            self.first_gross = difference


RELATIVE: Final = 1e-9
"""Relative difference that a different processor may cause in the least significant bits of a number."""
_ABSOLUTE: Final = 1e-12


def close_enough(a: float, b: float) -> bool:
    """Return True if two numbers differ by no more than a different processor may cause."""
    return abs(a - b) <= max(RELATIVE * max(abs(a), abs(b)), _ABSOLUTE)


def same_bits(a: Iterable[float], b: Iterable[float]) -> bool:
    """Return True if two vectors are equal bit for bit: -0.0 differs from 0.0, and a NaN equals itself."""
    x, y = tuple(a), tuple(b)
    # Only zeros have two bit patterns.
    plain = x == y and 0.0 not in x
    return plain or (len(x) == len(y) and struct.pack(f"{len(x)}d", *x) == struct.pack(f"{len(y)}d", *y))
