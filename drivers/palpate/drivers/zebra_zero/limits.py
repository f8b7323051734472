"""What the joints may do, and what becomes of a set-point that asks for more."""

from __future__ import annotations

import enum
from collections.abc import Sequence
from dataclasses import dataclass
from math import copysign, inf, isfinite

from palpate.drivers.errors import SettingError
from palpate.drivers.zebra_zero.counts import DEVICE, JOINTS, Six, six


class AppliedReason(enum.Enum):
    """Why the applied set-point is not the one that was asked for."""

    AS_ASKED = "as asked"
    POSITION_LIMIT = "joint position limit"
    VELOCITY_LIMIT = "joint velocity or acceleration limit"
    STOPPED = "arm is stopped"


@dataclass(frozen=True, slots=True)
class Applied:
    """A set-point after the limits.

    Attributes:
        position_rad: Joint angles, (6,).
        reason: ``AS_ASKED`` exactly when nothing was changed.
    """

    position_rad: Six
    reason: AppliedReason = AppliedReason.AS_ASKED


@dataclass(frozen=True, slots=True)
class JointLimits:
    """Limits of the six joints.

    Attributes:
        lower_rad: Lower ends, (6,). FACT: the port. Evidence: joints 1 to 3 medium, wrist weak (the client has a note
            there that they are still to be fixed).
        upper_rad: Upper ends, (6,); likewise.
        velocity_rad_per_s: Highest joint velocity. FACT: a software cap of the port; of the arm itself NOT FOUND.
        acceleration_rad_per_s2: Highest joint acceleration. CALC from the port's servo default of 10 000 on joints 1
            to 3. (One configuration of it has 0.2, another software cap.)

    Raises:
        SettingError: Limits that leave no room, or are not finite.
    """

    lower_rad: Six = (-3.14, -1.07, -1.70, -3.14, -3.14, -3.14)
    upper_rad: Six = (3.14, 1.70, 1.07, 3.14, 3.14, 3.14)
    velocity_rad_per_s: float = 1.0
    acceleration_rad_per_s2: float = 19.0

    def __post_init__(self) -> None:
        numbers = (*self.lower_rad, *self.upper_rad, self.velocity_rad_per_s, self.acceleration_rad_per_s2)
        if len(self.lower_rad) != JOINTS or len(self.upper_rad) != JOINTS or not all(isfinite(x) for x in numbers):
            raise SettingError(DEVICE, f"joint limits {self}", f"must be finite, for {JOINTS} joints")
        if any(lower >= upper for lower, upper in zip(self.lower_rad, self.upper_rad, strict=True)):
            raise SettingError(DEVICE, f"joint limits {self}", "each lower one must be below the upper one")
        if min(self.velocity_rad_per_s, self.acceleration_rad_per_s2) <= 0.0:
            raise SettingError(DEVICE, f"joint limits {self}", "velocity and acceleration must be positive")

    def outside(self, position_rad: Sequence[float], tolerance_rad: float = 0.0) -> int | None:
        """The first joint, counted from 0, that is beyond a limit by more than the tolerance; None when none is."""
        for joint, angle in enumerate(position_rad):
            # Written so that an angle that is no number is outside as well.
            if not self.lower_rad[joint] - tolerance_rad <= angle <= self.upper_rad[joint] + tolerance_rad:
                return joint
        return None

    def applied(self, asked_rad: Sequence[float], previous_rad: Six, velocity_rad_per_s: Six, step_s: float) -> Applied:
        """The set-point for the next cycle: within the position limits, and no further than the joints may go.

        All joints are held back by the same share, so the path keeps its direction. Speeding up is limited, slowing
        down is not: a set-point that overshoots what was asked would press on what the arm touches, while the step
        that remains is no larger than one the servos have just followed.

        Args:
            asked_rad: What is wanted, (6,).
            previous_rad: Set-point before.
            velocity_rad_per_s: Velocity of the set-points so far.
            step_s: Time since then; at most the period of the cycle.

        Raises:
            RefusedError: There are not six finite angles.
        """
        asked = six(asked_rad)
        limits = zip(asked, self.lower_rad, self.upper_rad, strict=True)
        inside = six([min(max(q, lower), upper) for q, lower, upper in limits])
        steps = six([q - p for q, p in zip(inside, previous_rad, strict=True)])
        moves = zip(steps, velocity_rad_per_s, strict=True)
        share = min(self._share(step, velocity, step_s) for step, velocity in moves)
        if share < 1.0:
            shortened = six([p + share * step for p, step in zip(previous_rad, steps, strict=True)])
            return Applied(shortened, AppliedReason.VELOCITY_LIMIT)
        return Applied(inside, AppliedReason.AS_ASKED if inside == asked else AppliedReason.POSITION_LIMIT)

    def _share(self, step_rad: float, velocity_rad_per_s: float, step_s: float) -> float:
        if step_rad == 0.0:
            return inf
        already = max(0.0, copysign(1.0, step_rad) * velocity_rad_per_s)
        speed = min(self.velocity_rad_per_s, already + self.acceleration_rad_per_s2 * step_s)
        return speed * step_s / abs(step_rad)
