"""Does the measured force follow the gripper's spring? A tool that presses is lifted a little to see."""

import enum
from typing import Final

from palpate.core.ports import CONTROL_RATE_HZ

LOWEST_SHARE: Final = 0.65
HIGHEST_SHARE: Final = 1.5
"""Bounds of the measured stiffness as a share of the gripper's: a gripper is known to some ten per cent, and a sensor
that is dead, or shows half or twice the force, is outside."""
_LIFT_M: Final = 4e-4
_LIFT_SHARE: Final = 0.4
"""At most so much of the pressing force is taken off, so that contact is kept."""
_LEAST_PRESS: Final = 1.2
"""The force before the lift, over what the lift takes off: with less, contact is lost on the way."""
_SAMPLES: Final = 8
"""New samples averaged before and after: with noise of 0.3 N the share then has a standard deviation of 0.075."""
_REST_TICKS: Final = 4
"""Ticks of rest after a movement, for the lag of servos and sensor."""
_ARRIVED_SHARE: Final = 0.7
_LONGEST_WAIT_TICKS: Final = CONTROL_RATE_HZ // 4
"""An arm on a slow bus may take so long to show that it has moved."""
_LEAST_LIFT_SHARE: Final = 0.25
"""An arm that lifts by less than this share of what it was commanded counts as lifted by this."""
_ROUNDS: Final = 2
"""A share out of bounds is measured once more before it counts."""


class Mean:
    """A mean over new samples; a repeated one adds nothing.

    Attributes:
        value: The mean so far; 0 before the first.
    """

    __slots__ = ("_count", "value")

    def __init__(self) -> None:
        self.value, self._count = 0.0, 0

    def add(self, number: float, new: bool) -> int:
        """Take a number in if it is new; returns how many there are."""
        if new:
            self._count += 1
            self.value += (number - self.value) / self._count
        return self._count


class _Stage(enum.Enum):
    BEFORE = "before"
    LIFT = "lift"
    REST = "rest"
    AFTER = "after"
    BACK = "back"


class AxialCheck:
    """Force before and after a lift of at most 0.4 mm, over what the gripper's axial spring would give.

    Encoders and commands place the flange; between it and the peg lies the gripper's spring. As long as the peg rests
    on something, be it stuck or free, the force changes by the spring's stiffness times the lift. A sensor that is
    held, dead, noisy or wrongly scaled gives another number.

    Attributes:
        share: Measured stiffness as a share of the gripper's; None until it is known, and when contact slipped away
            before the lift, so that there was nothing to measure.
    """

    def __init__(self, stiffness_N_per_m: float, press_N: float, speed_m_s: float, period_s: float) -> None:
        self._stiffness, self._speed, self._period_s = stiffness_N_per_m, speed_m_s, period_s
        self._lift_m = min(_LIFT_M, _LIFT_SHARE * press_N / stiffness_N_per_m)
        self.begin()

    def begin(self) -> None:
        """The next :meth:`velocity_m_s` is the first of a check; the tool has to be pressing."""
        self.share: float | None = None
        self._rounds = 0
        self._enter(_Stage.BEFORE)

    @property
    def passed(self) -> bool:
        """Whether the share is known and within its bounds."""
        return self.share is not None and LOWEST_SHARE <= self.share <= HIGHEST_SHARE

    @property
    def tip_depth_m(self) -> float:
        """Depth of the tip while it pressed, before the last lift: by encoders, corrected for the gripper's spring."""
        return self._pressed_m + self._pressed_N / self._stiffness

    def velocity_m_s(self, force_z_N: float, new: bool, reference_z_m: float, measured_z_m: float) -> float | None:
        """Velocity along the tool axis for this tick; None when the check is over and the tool is back in place.

        Args:
            force_z_N: Tared force along the tool axis, negative while pressing.
        """
        self._ticks += 1
        if self._stage is _Stage.BEFORE:
            if self._ticks == 1:
                self._home_m, self._measured_home_m = reference_z_m, measured_z_m
            # The servos are still on the way of the last command in the first ticks.
            if self._ticks > _REST_TICKS and self._measured(force_z_N, measured_z_m, new):
                self._pressed_N, self._pressed_m = self._force.value, self._depth.value
                if self._pressed_N > -_LEAST_PRESS * self._stiffness * self._lift_m:
                    self.share = None
                    return None
                self._enter(_Stage.LIFT)
            return 0.0
        if self._stage is _Stage.LIFT:
            left = reference_z_m - (self._home_m - self._lift_m)
            if left > 1e-9:
                return -min(self._speed, left / self._period_s)
            self._enter(_Stage.REST)
        if self._stage is _Stage.REST:
            arrived = self._measured_home_m - measured_z_m >= _ARRIVED_SHARE * self._lift_m
            if self._ticks >= _LONGEST_WAIT_TICKS or (arrived and self._ticks >= _REST_TICKS):
                self._enter(_Stage.AFTER)
            return 0.0
        if self._stage is _Stage.AFTER:
            if self._measured(force_z_N, measured_z_m, new):
                # By the encoders: servos overshoot, and an arm that does not follow at all gives no share.
                lifted_m = max(self._pressed_m - self._depth.value, _LEAST_LIFT_SHARE * self._lift_m)
                self.share = (self._force.value - self._pressed_N) / (self._stiffness * lifted_m)
                self._rounds += 1
                self._enter(_Stage.BACK)
            return 0.0
        left = self._home_m - reference_z_m
        if left > 1e-9:
            return min(self._speed, left / self._period_s)
        if self.passed or self._rounds == _ROUNDS:
            return None
        self._enter(_Stage.BEFORE)
        return 0.0

    def _measured(self, force_z_N: float, depth_m: float, new: bool) -> bool:
        self._depth.add(depth_m, new)
        return self._force.add(force_z_N, new) == _SAMPLES

    def _enter(self, stage: _Stage) -> None:
        self._stage, self._ticks, self._force, self._depth = stage, 0, Mean(), Mean()
