"""The limits of the force in the order in which they stop the arm, and what happens then.

All but those of the way to the ready pose count from the task's tare, or before it from the trial's first sample.
"""

from dataclasses import dataclass
from typing import Final

from palpate.core.supervision.config import SupervisionConfig
from palpate.core.trial import TaskConfig

WITHDRAWAL_SHARE: Final = 2.0
"""While a tool is drawn out of a hole the force may be so many times the limit: what had pressed lets go."""

_TRIP: Final = "trip: {on_trip}, and no further trial until it is acknowledged"
_WALK: Final = "the arm is stopped and the run ends"


@dataclass(frozen=True, slots=True)
class ForceLimit:
    """One of them."""

    limit_N: float
    setting: str
    watches: str
    then: str


def force_limits(supervision: SupervisionConfig, task: TaskConfig) -> list[ForceLimit]:
    """All limits of the force, the one that stops the arm first in front."""
    trip = _TRIP.format(on_trip=supervision.on_trip)
    ends = "the trial ends as `force limit` with the arm stopped; the next one begins, unless the supervisor trips too"
    every = "every tick of a trial"
    limits = (
        ForceLimit(
            supervision.unexpected_contact_N, "supervision.unexpected_contact_N",
            "ticks in which nothing may be touched; before taring since that phase began", trip,
        ),
        ForceLimit(task.max_force_N, "task.max_force_N", every, ends),
        ForceLimit(
            task.max_force_N, "task.max_force_N", "the way to the ready pose, on rigs; since its first sample", _WALK
        ),
        ForceLimit(supervision.max_force_N, "supervision.max_force_N", every, trip),
        ForceLimit(
            WITHDRAWAL_SHARE * task.max_force_N, f"{WITHDRAWAL_SHARE:g} x task.max_force_N",
            "drawing the tool out of a hole before that way", _WALK,
        ),
    )  # fmt: skip
    # Stable: of two that are equal the task's own is seen first.
    return sorted(limits, key=lambda each: each.limit_N)


def limits_line(supervision: SupervisionConfig, task: TaskConfig) -> str:
    """The limits in one line, to be shown when a run on a rig starts."""
    texts = (f"{each.limit_N:g} N ({each.setting})" for each in force_limits(supervision, task))
    return "limits of the force: " + ", ".join(dict.fromkeys(texts))
