"""Limits of position and velocity on joint commands: what an arm adapter applies of what it is asked for."""

from __future__ import annotations

from operator import le, sub

from palpate.core.ports.values import AppliedCommand, CommandReason, JointVector


class CommandLimiter:
    """Shortens steps to the velocity limit, then keeps them within the position limits, in this order.

    Steps count from what was held when the tick began: a newer command of one tick replaces the one before instead of
    adding to it.

    Args:
        lower_rad: Lower joint limits, (n,).
        upper_rad: Upper joint limits, (n,).
        velocity_limit_rad_s: Joint velocity limits, (n,).
        rate_Hz: Rate of commands.
    """

    def __init__(
        self, lower_rad: JointVector, upper_rad: JointVector, velocity_limit_rad_s: JointVector, rate_Hz: float
    ) -> None:
        self.joints = len(lower_rad)
        self._lower, self._upper = lower_rad, upper_rad
        self._reach = tuple(v / rate_Hz for v in velocity_limit_rad_s)
        self._least_reach = min(self._reach)
        self._held: JointVector = ()
        self._base: JointVector = ()
        self._now: int | None = None

    def start(self, held_rad: JointVector) -> None:
        """The arm stands here, and steps count from here."""
        self._held, self._now = held_rad, None

    def limited(self, asked_rad: JointVector, now: int) -> AppliedCommand:
        """What is to be applied, and why it differs.

        Args:
            asked_rad: The command, (n,).
            now: Anything that tells one tick from the next: its number, or its time.
        """
        if self._now != now:
            self._now, self._base = now, self._held
        # Nearly every command is well inside all limits, and this is the cheapest way to see it.
        inside = all(map(le, self._lower, asked_rad)) and all(map(le, asked_rad, self._upper))
        if inside and max(map(abs, map(sub, asked_rad, self._base))) <= self._least_reach:
            self._held = asked_rad
            return AppliedCommand(asked_rad)
        reason = CommandReason.AS_ASKED
        applied = []
        for value, base, reach, low, high in zip(
            asked_rad, self._base, self._reach, self._lower, self._upper, strict=True
        ):
            slow = min(max(value, base - reach), base + reach)
            within = min(max(slow, low), high)
            if within != slow:
                reason = CommandReason.POSITION_LIMIT
            elif slow != value and reason is CommandReason.AS_ASKED:
                reason = CommandReason.VELOCITY_LIMIT
            applied.append(within)
        self._held = tuple(applied)
        return AppliedCommand(self._held, reason)
