"""Times what the core does, from outside: by the methods of the parts that a task is built of."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final, ParamSpec, TypeVar

from palpate.adapters.hardware.real_time.sections import TickSection
from palpate.adapters.hardware.real_time.stopwatch import Stopwatch
from palpate.core.insertion.agent import Agent
from palpate.core.insertion.measurement import Measurement
from palpate.core.motion.tip_motion import TipMotion

P = ParamSpec("P")
R = TypeVar("R")

_PARTS: Final = (
    (TickSection.PERCEIVE, ("update",)),
    (TickSection.DECIDE, ("record_effort", "perceive", "choose")),
    (TickSection.CONTROL, ("move",)),
)


def timed_parts(measurement: Measurement, agent: Agent, motion: TipMotion, stopwatch: Stopwatch) -> None:
    """Time these parts of one task for good; what they do stays the same.

    Perceiving is from samples to the task frame, every tick; deciding is features, symbols, learning and choosing,
    which only an action's end brings, and the sums of effort; control is reference and inverse kinematics.

    Args:
        measurement: Its ``update`` is perceiving.
        agent: Its ``record_effort``, ``perceive`` and ``choose`` are deciding.
        motion: Its ``move`` is control.
        stopwatch: Is told.
    """
    for part, (section, names) in zip((measurement, agent, motion), _PARTS, strict=True):
        for name in names:
            # On the object, not on its class: other tasks stay as they are.
            setattr(part, name, _timed(getattr(part, name), stopwatch, int(section)))


def _timed(function: Callable[P, R], stopwatch: Stopwatch, section: int) -> Callable[P, R]:
    now, spent = stopwatch.now_ns, stopwatch.spent

    def call(*args: P.args, **kwargs: P.kwargs) -> R:
        begin = now()
        result = function(*args, **kwargs)
        spent[section] += now() - begin
        return result

    return call
