"""State machine and servo for an emulated CiA 402 drive."""

import enum
from math import copysign
from typing import Final

from palpate.simulation.emulators.cia402.objects import (
    CSP,
    FOLLOWING_ERROR_WINDOW,
    INTERPOLATION,
    MODE,
    QUICK_STOP_DECELERATION,
    TARGET_POSITION,
    ObjectDictionary,
)
from palpate.simulation.emulators.motors import JointPlant


class PowerState(enum.Enum):
    """A drive's eight states, with their bits in the statusword."""

    NOT_READY = 0b0000_0000
    SWITCH_ON_DISABLED = 0b0100_0000
    READY = 0b0010_0001
    SWITCHED_ON = 0b0010_0011
    ENABLED = 0b0010_0111
    QUICK_STOP = 0b0000_0111
    FAULT_REACTION = 0b0000_1111
    FAULT = 0b0000_1000


_SWITCH_ON: Final = 1 << 0
_ENABLE_VOLTAGE: Final = 1 << 1
_NO_QUICK_STOP: Final = 1 << 2
_ENABLE_OPERATION: Final = 1 << 3
_FAULT_RESET: Final = 1 << 7

_VOLTAGE_ENABLED: Final = 1 << 4
_REMOTE: Final = 1 << 9
_FOLLOWS_COMMAND: Final = 1 << 12

POWERED: Final = (PowerState.ENABLED, PowerState.QUICK_STOP, PowerState.FAULT_REACTION)
"""States in which the motor produces torque."""


class PowerMachine:
    """A drive's state machine."""

    def __init__(self) -> None:
        self.state = PowerState.NOT_READY
        self._previous = 0

    @property
    def statusword(self) -> int:
        """Object 0x6041, including bits outside the state, which a real drive also sets."""
        word = self.state.value | _REMOTE
        if self.state not in (PowerState.NOT_READY, PowerState.SWITCH_ON_DISABLED, PowerState.FAULT):
            word |= _VOLTAGE_ENABLED
        if self.state is PowerState.ENABLED:
            word |= _FOLLOWS_COMMAND
        return word

    def wake(self) -> None:
        """Complete the self-test."""
        if self.state is PowerState.NOT_READY:
            self.state = PowerState.SWITCH_ON_DISABLED

    def apply(self, controlword: int) -> None:
        """Execute a controlword (object 0x6040)."""
        rising = controlword & ~self._previous
        self._previous = controlword
        if self.state is PowerState.FAULT:
            if rising & _FAULT_RESET:
                self.state = PowerState.SWITCH_ON_DISABLED
        elif self.state not in (PowerState.NOT_READY, PowerState.FAULT_REACTION):
            self._power(controlword)

    def fail(self) -> None:
        """Report a fault."""
        if self.state is not PowerState.FAULT:
            self.state = PowerState.FAULT_REACTION

    def stopped(self, *, stay: bool) -> None:
        """Complete a fault reaction or a quick stop, after which the motor may keep its torque (0x605A, 5 to 8)."""
        if self.state is PowerState.FAULT_REACTION:
            self.state = PowerState.FAULT
        elif self.state is PowerState.QUICK_STOP and not stay:
            self.state = PowerState.SWITCH_ON_DISABLED

    def _power(self, word: int) -> None:
        if not word & _ENABLE_VOLTAGE:
            self.state = PowerState.SWITCH_ON_DISABLED
        elif not word & _NO_QUICK_STOP:
            moving = self.state in (PowerState.ENABLED, PowerState.QUICK_STOP)
            self.state = PowerState.QUICK_STOP if moving else PowerState.SWITCH_ON_DISABLED
        elif self.state is PowerState.SWITCH_ON_DISABLED:
            if not word & _SWITCH_ON:
                self.state = PowerState.READY
        elif self.state is PowerState.QUICK_STOP:
            if word & _SWITCH_ON and word & _ENABLE_OPERATION:
                self.state = PowerState.ENABLED
        elif not word & _SWITCH_ON:
            self.state = PowerState.READY
        elif word & _ENABLE_OPERATION:
            # From ready, these are two transitions in one word, which the standard allows.
            self.state = PowerState.ENABLED
        else:
            self.state = PowerState.SWITCHED_ON


_NS: Final = 1e-9
_NO_WINDOW: Final = 0xFFFF_FFFF


class DriveServo:
    """Position demand for an axis over time.

    The demand moves linearly to a new target over the interpolation period (object 0x60C2), as in real drives. A quick
    stop decelerates from the current speed. Without a mode of operation, the demand stays constant.
    """

    def __init__(self, motors: JointPlant, axis: int, objects: ObjectDictionary) -> None:
        self._motors, self._axis, self._objects = motors, axis, objects
        self._demand = 0.0
        self._goal = 0.0
        self._speed = 0.0

    @property
    def stationary(self) -> bool:
        """Return True if a stop is complete."""
        return self._speed == 0.0

    @property
    def measured(self) -> int:
        """Return the encoder reading."""
        return self._motors.motor_counts(self._axis)

    @property
    def following_error(self) -> bool:
        """Return True if the motor lags too far behind the demand."""
        window = self._objects[FOLLOWING_ERROR_WINDOW]
        watched = self._objects[MODE] == CSP and window != _NO_WINDOW
        return watched and abs(self._demand - self.measured) > window

    def engage(self) -> None:
        """Switch the torque on, and hold the current position until the first target."""
        self._demand = self._goal = float(self.measured)
        self._speed = 0.0

    def retarget(self) -> None:
        """Apply the latest target when a SYNC is received."""
        if self._objects[MODE] != CSP:
            self._goal, self._speed = self._demand, 0.0
            return
        self._goal = float(self._objects[TARGET_POSITION])
        period_s = self._objects.sub(INTERPOLATION, 1) * 10.0 ** self._objects.sub(INTERPOLATION, 2)
        self._speed = (self._goal - self._demand) / period_s if period_s > 0.0 else 0.0
        if period_s <= 0.0:
            self._demand = self._goal

    def advance(self, elapsed_ns: int, *, stopping: bool) -> None:
        """Advance the demand, and pass it on to the motor."""
        elapsed_s = elapsed_ns * _NS
        if stopping:
            self._slow_down(elapsed_s)
        else:
            step = self._speed * elapsed_s
            if abs(step) >= abs(self._goal - self._demand):
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
