"""Position and velocity limits on joint commands, applied by arm adapters."""

from math import inf
from operator import le, sub
from typing import Final

from palpate.core.ports.values import AppliedCommand, CommandReason, JointVector

_CREDIT_PERIODS: Final = 1.25
"""Maximum unused time that is carried over, in command periods, because an early command may follow a late one."""
_ROUNDING_S: Final = 1e-6
"""Tolerance on the allowed time, because ticks are whole nanoseconds."""


class StepLimiter:
    """Limiter that clamps a command to the position limits, then shortens the step to the velocity limits.

    All joints are scaled by the same factor, so the direction in joint space stays the same.

    Args:
        lower_rad: Lower joint limits, (n,).
        upper_rad: Upper joint limits, (n,).
        velocity_limit_rad_s: Joint velocity limits, (n,).
    """

    def __init__(self, lower_rad: JointVector, upper_rad: JointVector, velocity_limit_rad_s: JointVector) -> None:
        self._lower, self._upper, self._speed = lower_rad, upper_rad, velocity_limit_rad_s
        self._slowness_s = 1.0 / min(velocity_limit_rad_s)

    def limited(self, requested_rad: JointVector, from_rad: JointVector, may_s: float) -> tuple[AppliedCommand, float]:
        """Return the applied command, the reason for any change, and the step's duration, in s, at the velocity limits.

        Args:
            requested_rad: The command, (n,).
            from_rad: Position at the start of the step, (n,).
            may_s: Time available for the step.
        """
        inside = all(map(le, self._lower, requested_rad)) and all(map(le, requested_rad, self._upper))
        # This check is the cheapest: nearly every command passes even if all joints are as slow as the slowest one.
        steps = tuple(map(sub, requested_rad, from_rad))
        up, down = max(steps), -min(steps)
        needs_s = (up if up > down else down) * self._slowness_s
        if inside and needs_s <= may_s:
            return AppliedCommand(requested_rad), needs_s
        within = requested_rad
        if not inside:
            limits = zip(requested_rad, self._lower, self._upper, strict=True)
            within = tuple(min(max(value, low), high) for value, low, high in limits)
            steps = tuple(map(sub, within, from_rad))
        needs_s = max(abs(step) / speed for step, speed in zip(steps, self._speed, strict=True))
        reason = CommandReason.AS_REQUESTED if inside else CommandReason.POSITION_LIMIT
        if needs_s > may_s:
            share, needs_s = may_s / needs_s, may_s
            reason = CommandReason.VELOCITY_LIMIT
            within = tuple(start + share * step for start, step in zip(from_rad, steps, strict=True))
        return AppliedCommand(within, reason), needs_s


class CommandLimiter:
    """Limiter for commands that arrive at any time, based on elapsed time rather than on the number of commands.

    Over any time T no joint moves further than its velocity limit times T plus 1.25 command periods, and no single step
    is longer than one period allows. If several commands have the same timestamp, the last one replaces the others. For
    the limits, see :class:`StepLimiter`.
    """

    def __init__(
        self, lower_rad: JointVector, upper_rad: JointVector, velocity_limit_rad_s: JointVector, rate_Hz: float
    ) -> None:
        self.joints = len(lower_rad)
        self._steps = StepLimiter(lower_rad, upper_rad, velocity_limit_rad_s)
        self._period_s = 1.0 / rate_Hz
        self._most_credit_s = _CREDIT_PERIODS * self._period_s
        self._held: JointVector = ()
        self._base: JointVector
        self._now_ns: int | None = None
        self._left_s = 0.0

    def start(self, held_rad: JointVector) -> None:
        """Begin limiting steps, starting from the given arm position."""
        self._held, self._now_ns = held_rad, None

    def limited(self, requested_rad: JointVector, now_ns: int) -> AppliedCommand:
        """Return the applied command, with the reason for any change.

        Args:
            requested_rad: The command, (n,).
            now_ns: Command time on any monotonic clock.
        """
        if self._now_ns != now_ns:
            # An arm that has just started has unlimited credit.
            passed_s = inf if self._now_ns is None else (now_ns - self._now_ns) * 1e-9
            credit_s = self._left_s + passed_s if passed_s > 0.0 else self._left_s
            self._credit_s = credit_s if credit_s < self._most_credit_s else self._most_credit_s
            self._now_ns, self._base = now_ns, self._held
        may_s = self._credit_s + _ROUNDING_S
        if may_s > self._period_s:
            may_s = self._period_s
        applied, needs_s = self._steps.limited(requested_rad, self._base, may_s)
        self._left_s, self._held = self._credit_s - needs_s, applied.position_rad
        return applied
