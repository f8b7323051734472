"""Whether a recorded trial was felt in time: a loop or a device that is held up makes a cell look softer than it is."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Final

import numpy as np

from palpate.adapters.log import TickRecord
from palpate.core.ports import CONTROL_RATE_HZ

_LATE_NS: Final = 500_000_000 // CONTROL_RATE_HZ
_LATE_SHARE: Final = 0.02
"""Of the ticks, those that may be late or missing."""
_STALL_TICKS: Final = 3
"""So much longer than usual may news be waited for."""
_STILL_TICKS: Final = 3
"""A joint may stand so much longer than from one news to the next, while it is led on."""
_LED_TICKS: Final = 8
_LED_STEPS: Final = 2.0
"""Encoder steps a tick by which a joint is led that must be seen to move."""


def comes_late(slots: Mapping[int, TickRecord], step_rad: Sequence[float]) -> str:
    """Who came late: ``loop``, ``devices``, or nobody, the empty text.

    Args:
        slots: The ticks by their control periods.
        step_rad: Angle of an encoder count, (n,).
    """
    numbers = list(slots)
    late = sum((each.time_ns or 0) - (each.deadline_ns or 0) > _LATE_NS for each in slots.values())
    missing = numbers[-1] - numbers[0] + 1 - len(numbers)
    if late + missing > _LATE_SHARE * len(numbers):
        return "loop"
    forces = [(slot, each.wrench.sequence) for slot, each in slots.items() if each.wrench is not None]
    joints = [(slot, each.joints.sequence) for slot, each in slots.items() if each.joints is not None]
    if any(_longest(_news(each)) > np.median(_news(each)) + _STALL_TICKS for each in (forces, joints)):
        return "devices"
    return "devices" if _stands_still(slots, float(np.median(_news(joints))), step_rad) else ""


def _news(read: Sequence[tuple[int, int]]) -> list[int]:
    """Ticks from each news to the next."""
    first = [slot for number, (slot, sequence) in enumerate(read) if not number or sequence != read[number - 1][1]]
    return [after - before for before, after in pairwise(first)] or [len(read)]


def _longest(waits: Sequence[int]) -> int:
    return max(waits)


def _stands_still(slots: Mapping[int, TickRecord], usual: float, step_rad: Sequence[float]) -> bool:
    """Whether a joint that is led on shows one angle for long: its drive's word goes on, and it does not."""
    rows = [
        (slot, each.asked_rad, each.joints.position_rad)
        for slot, each in slots.items()
        if each.asked_rad is not None and each.joints is not None
    ]
    for joint, step in enumerate(step_rad):
        led = still = 0
        for (_, before, shown), (_, after, now) in pairwise(rows):
            led = led + 1 if abs(after[joint] - before[joint]) > _LED_STEPS * step else 0
            still = still + 1 if now[joint] == shown[joint] else 0
            if led > _LED_TICKS and still > usual + _STILL_TICKS:
                return True
    return False
