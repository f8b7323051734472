"""How far and how fast the clauses may move an arm that somebody could stand beside."""

from collections.abc import Iterator
from dataclasses import dataclass
from math import ceil, isfinite
from typing import Final

from palpate.core.errors import ConfigurationError
from palpate.core.ports import CONTROL_RATE_HZ, JointVector

_TOLD_APART: Final = 2.0
"""A move must be so many tolerances long to be told from standing still, with a margin."""
_ROUNDING: Final = 1e-6
"""A way of one step is not two, whatever its floats say."""


@dataclass(frozen=True, slots=True)
class MotionLimits:
    """What the caller allows; with a rate of 0 nothing moves.

    Attributes:
        rate_rad_s: Highest rate at which a joint may be asked to move.
        reach_rad: Farthest that a joint may be asked to go from ``home_rad``.

    Raises:
        ConfigurationError: A number that is negative or not finite.
    """

    rate_rad_s: float
    reach_rad: float

    def __post_init__(self) -> None:
        for name in ("rate_rad_s", "reach_rad"):
            if not (isfinite(value := getattr(self, name)) and value >= 0.0):
                raise ConfigurationError(name, value, "a finite number from 0 up")

    @property
    def tick_rad(self) -> float:
        """Farthest that a joint may be asked to move within one control tick."""
        return self.rate_rad_s / CONTROL_RATE_HZ

    def step_rad(self, wanted_rad: float, tolerance_rad: float) -> float:
        """The small move of a rig, so short that the way from one side to the other fits a tick.

        Raises:
            ConfigurationError: At this rate a move of one tick cannot be told from standing still.
        """
        step_rad = min(wanted_rad, 0.5 * self.tick_rad)
        least = _TOLD_APART * tolerance_rad
        if self.rate_rad_s and step_rad <= least:
            accepted = f"more than {2.0 * least * CONTROL_RATE_HZ:.3g} rad/s, or nothing shows beside tolerance_rad"
            raise ConfigurationError("rate_rad_s", self.rate_rad_s, accepted)
        return step_rad


NO_MOTION: Final = MotionLimits(0.0, 0.0)
"""Nothing is sent to the arm."""


def ramp(begin_rad: JointVector, end_rad: JointVector, step_rad: float) -> Iterator[JointVector]:
    """The way from one pose to another in steps of at most ``step_rad`` a joint, all joints arriving together.

    With no step at all it is the end alone, which then nobody may send.
    """
    far = max((abs(e - b) for b, e in zip(begin_rad, end_rad, strict=True)), default=0.0)
    steps = ceil(far / step_rad - _ROUNDING) if step_rad else 1
    for k in range(1, steps):
        yield tuple(b + k / steps * (e - b) for b, e in zip(begin_rad, end_rad, strict=True))
    if steps:
        yield end_rad
