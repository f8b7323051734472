"""The servo inside an emulated drive: from targets to a position that the motor is told to hold."""

from __future__ import annotations

from math import copysign
from typing import Final, Protocol

from palpate.simulation.emulators.cia402.objects import (
    FOLLOWING_ERROR_WINDOW,
    INTERPOLATION,
    MODE,
    QUICK_STOP_DECELERATION,
    TARGET_POSITION,
    TARGET_VELOCITY,
    ObjectDictionary,
)

CSP: Final = 8
CSV: Final = 9
_NS: Final = 1e-9
_NO_WINDOW: Final = 0xFFFF_FFFF


class Motors(Protocol):
    """What the drives turn; any ``Plant`` of this package is one."""

    def set_motor_counts(self, axis: int, counts: float) -> None:
        """The servo of an axis now holds this position, in counts."""

    def motor_counts(self, axis: int) -> int:
        """What the encoder on the motor's shaft counts now."""

    def advance(self, now_ns: int) -> None:
        """Let time go on until ``now_ns``."""


class Servo:
    """Position demand of one axis over time.

    In CSP a new target is approached in a straight line over the interpolation period (object 0x60C2), as drives do;
    in CSV the demand runs at the target velocity. A quick stop decelerates from the speed of that moment.

    Args:
        motors: What is driven.
        axis: Which motor.
        objects: Targets, mode and limits.
    """

    def __init__(self, motors: Motors, axis: int, objects: ObjectDictionary) -> None:
        self._motors, self._axis, self._objects = motors, axis, objects
        self._demand = 0.0
        self._goal = 0.0
        self._speed = 0.0

    @property
    def at_rest(self) -> bool:
        """Whether a stop has done its work."""
        return self._speed == 0.0

    @property
    def measured(self) -> int:
        """What the encoder says."""
        return self._motors.motor_counts(self._axis)

    @property
    def following_error(self) -> bool:
        """Whether the motor has fallen too far behind, in CSP."""
        window = self._objects[FOLLOWING_ERROR_WINDOW]
        watched = self._objects[MODE] == CSP and window != _NO_WINDOW
        return watched and abs(self._demand - self.measured) > window

    def engage(self) -> None:
        """Torque comes on: hold where the motor is, until the next target."""
        self._demand = self._goal = float(self.measured)
        self._speed = 0.0

    def retarget(self) -> None:
        """A SYNC: take the newest target over."""
        if self._objects[MODE] == CSP:
            self._goal = float(self._objects[TARGET_POSITION])
            period_s = self._objects.sub(INTERPOLATION, 1) * 10.0 ** self._objects.sub(INTERPOLATION, 2)
            self._speed = (self._goal - self._demand) / period_s if period_s > 0.0 else 0.0
            if period_s <= 0.0:
                self._demand = self._goal
        else:
            self._speed = float(self._objects[TARGET_VELOCITY])

    def advance(self, elapsed_ns: int, *, stopping: bool) -> None:
        """Let the demand go on, and tell the motor."""
        elapsed_s = elapsed_ns * _NS
        if stopping:
            self._slow_down(elapsed_s)
        else:
            step = self._speed * elapsed_s
            if self._objects[MODE] == CSP and abs(step) >= abs(self._goal - self._demand):
                self._demand, self._speed = self._goal, 0.0
            else:
                self._demand += step
        self._motors.set_motor_counts(self._axis, self._demand)

    def _slow_down(self, elapsed_s: float) -> None:
        rate = self._objects[QUICK_STOP_DECELERATION]
        left = abs(self._speed) - rate * elapsed_s
        if left > 0.0:
            after = copysign(left, self._speed)
            self._demand += 0.5 * (self._speed + after) * elapsed_s
            self._speed = after
        else:
            self._demand += 0.5 * self._speed * abs(self._speed) / rate if rate else 0.0
            self._speed = 0.0
