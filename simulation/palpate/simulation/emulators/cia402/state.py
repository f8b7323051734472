"""The state machine inside an emulated CiA 402 drive: controlwords in, statusword out.

Standard knowledge, CiA 402-2; written from its table of controlword bits and state diagram, independently of any
driver. Bits of the controlword: 0 switch on, 1 enable voltage, 2 quick stop when low, 3 enable operation, 7 fault
reset.
"""

from __future__ import annotations

import enum
from typing import Final


class PowerState(enum.Enum):
    """The eight states, each with the bits of the statusword that tell it."""

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
"""States in which the motor is under torque."""


class PowerMachine:
    """One drive's state machine.

    Attributes:
        state: Where it is.
    """

    def __init__(self) -> None:
        self.state = PowerState.NOT_READY
        self._previous = 0

    @property
    def statusword(self) -> int:
        """Object 0x6041, with the bits besides the state as a real drive sets them."""
        word = self.state.value | _REMOTE
        if self.state not in (PowerState.NOT_READY, PowerState.SWITCH_ON_DISABLED, PowerState.FAULT):
            word |= _VOLTAGE_ENABLED
        if self.state is PowerState.ENABLED:
            word |= _FOLLOWS_COMMAND
        return word

    def wake(self) -> None:
        """Self-test passed."""
        if self.state is PowerState.NOT_READY:
            self.state = PowerState.SWITCH_ON_DISABLED

    def obey(self, controlword: int, *, fault_persists: bool) -> None:
        """Act on a controlword (object 0x6040).

        Args:
            controlword: As received.
            fault_persists: The cause of a fault is still there, so that it cannot be reset.
        """
        rising = controlword & ~self._previous
        self._previous = controlword
        if self.state is PowerState.FAULT:
            if rising & _FAULT_RESET and not fault_persists:
                self.state = PowerState.SWITCH_ON_DISABLED
        elif self.state not in (PowerState.NOT_READY, PowerState.FAULT_REACTION):
            self._power(controlword)

    def fail(self) -> None:
        """A fault appears."""
        if self.state is not PowerState.FAULT:
            self.state = PowerState.FAULT_REACTION

    def stopped(self, *, stay: bool) -> None:
        """The motor has come to rest during a quick stop or a fault reaction.

        Args:
            stay: Stay under torque in quick stop (option code 5 to 8 of object 0x605A).
        """
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
            # From ready this is two transitions in one word, which the standard allows.
            self.state = PowerState.ENABLED
        else:
            self.state = PowerState.SWITCHED_ON
