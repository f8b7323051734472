"""What of a command an arm may get: within its limits, not faster than allowed, never NaN."""

from __future__ import annotations

import enum
from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite
from typing import Final

from palpate.drivers.cia402.settings import JointDrive
from palpate.drivers.errors import RefusedError

_SLACK: Final = 1e-9
"""A step of exactly the greatest speed must not be called too fast for its rounding error."""


class AppliedReason(enum.Enum):
    """Why what was applied is not what was asked for."""

    AS_ASKED = "as asked"
    POSITION_LIMIT = "joint position limit"
    VELOCITY_LIMIT = "joint velocity limit"
    STOPPED = "arm is stopped"


@dataclass(frozen=True, slots=True)
class Applied:
    """Joint angles after limits.

    Attributes:
        position_rad: One angle a joint.
        reason: ``AS_ASKED`` exactly when nothing was changed.
    """

    position_rad: tuple[float, ...]
    reason: AppliedReason


def require_sound(asked_rad: Sequence[float], joints: Sequence[JointDrive]) -> tuple[float, ...]:
    """The set-point as floats.

    Raises:
        RefusedError: The number of angles is wrong, or one is not finite.
    """
    if len(asked_rad) != len(joints):
        problem = f"{len(asked_rad)} angles for {len(joints)} joints"
        raise RefusedError("arm", problem, "give one angle a joint")
    if not all(isfinite(angle) for angle in asked_rad):
        raise RefusedError("arm", f"set-point {tuple(asked_rad)} is not finite", "mend what computed it")
    return tuple(float(angle) for angle in asked_rad)


def limited(
    asked_rad: tuple[float, ...], previous_rad: tuple[float, ...], joints: Sequence[JointDrive], period_s: float
) -> Applied:
    """A set-point after position and velocity limits.

    A step that is too fast for one joint is shortened for all by the same share: the arm keeps its direction in
    joint space.

    Args:
        asked_rad: What the caller wants, finite.
        previous_rad: What was applied in the cycle before.
        joints: Limits.
        period_s: Time that the step may take.
    """
    within = tuple(min(max(q, j.lower_rad), j.upper_rad) for q, j in zip(asked_rad, joints, strict=True))
    share = 1.0
    for target, start, joint in zip(within, previous_rad, joints, strict=True):
        step, most = abs(target - start), joint.velocity_rad_per_s * period_s
        if step > most * (1.0 + _SLACK):
            share = min(share, most / step)
    if share < 1.0:
        shortened = tuple(start + share * (target - start) for target, start in zip(within, previous_rad, strict=True))
        return Applied(shortened, AppliedReason.VELOCITY_LIMIT)
    if within != asked_rad:
        return Applied(within, AppliedReason.POSITION_LIMIT)
    return Applied(asked_rad, AppliedReason.AS_ASKED)
