"""Whether a recorded trial was felt in time: a loop or a device that is held up makes a cell look softer than it is."""

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Final, TypeAlias

import numpy as np
import numpy.typing as npt

from palpate.adapters.log import TickRecord
from palpate.core.ports import CONTROL_RATE_HZ

Array: TypeAlias = npt.NDArray[np.float64]

_LATE_NS: Final = 500_000_000 // CONTROL_RATE_HZ
_LATE_SHARE: Final = 0.02
"""Of the ticks, those that may be late or missing."""
_STALL_TICKS: Final = 3
"""So much longer than usual may news be waited for."""
_BEHIND_TICKS: Final = 2.5
"""No joint is so much more behind than usual where all is in time: two ticks were the most over emulated wires."""
_LED_STEPS: Final = 6.0
"""Encoder steps a tick by which joints must go for that to be told."""


def comes_late(slots: Mapping[int, TickRecord]) -> str:
    """Who came late: ``loop``, ``devices``, or nobody, the empty text.

    Args:
        slots: The ticks by their control periods.
    """
    numbers = list(slots)
    late = sum((each.time_ns or 0) - (each.deadline_ns or 0) > _LATE_NS for each in slots.values())
    missing = numbers[-1] - numbers[0] + 1 - len(numbers)
    if late + missing > _LATE_SHARE * len(numbers):
        return "loop"
    forces = [(slot, each.wrench.sequence) for slot, each in slots.items() if each.wrench is not None]
    joints = [(slot, each.joints.sequence) for slot, each in slots.items() if each.joints is not None]
    held_up = any(max(_news(each)) > np.median(_news(each)) + _STALL_TICKS for each in (forces, joints))
    return "devices" if held_up else ""


def falls_behind(shown_rad: Array, simulated_rad: Array, step_rad: float) -> bool:
    """Whether an arm that is led on falls behind the simulated one, as where its drives' cell is held up.

    Args:
        shown_rad: What the encoders showed, (ticks, n); NaN where nothing was valid.
        simulated_rad: The same of the simulated arm, as late as the encoders usually are.
        step_rad: Angle of an encoder count.
    """
    speed = np.gradient(simulated_rad, axis=0)
    length = np.hypot.reduce(speed, axis=1)
    led = length > _LED_STEPS * step_rad
    along = ((shown_rad - simulated_rad) * speed).sum(axis=1)[led] / length[led] ** 2
    return bool((along < -_BEHIND_TICKS).any())


def _news(read: Sequence[tuple[int, int]]) -> list[int]:
    """Ticks from each news to the next."""
    first = [slot for number, (slot, sequence) in enumerate(read) if not number or sequence != read[number - 1][1]]
    return [after - before for before, after in pairwise(first)] or [len(read)]
