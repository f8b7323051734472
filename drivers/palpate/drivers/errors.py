"""Every error that a driver raises on purpose, in one tree; the adapters translate it for the core.

::

    DriverError                     says the device, what happened, what to do, and whose fault it is
    ├── SettingError                a setting that cannot work: the operator's to mend
    ├── WiringError                 no device, the wrong one, wrong baud rate, no permission: the operator's
    ├── RefusedError                a command that no device may get (NaN, beyond limits): the caller's
    ├── StateError                  asked for something out of order: the caller's
    ├── SilentError                 the device does not answer, or no longer: the device's, or its cable's
    │   └── LateError               it did, after its time was up: this computer's, or its adapter's
    ├── GarbledError                what it says makes no sense for too long: the line's
    └── DeviceFaultError            the device reports a fault of its own; it waits for a person

Malformed bytes on the wire are none of these: a codec counts them and goes on.
"""

import enum


class Blame(enum.Enum):
    """Whose fault an error is, and so who can mend it."""

    OPERATOR = "operator"
    CALLER = "our software"
    DEVICE = "device"
    HOST = "host"


class DriverError(Exception):
    """Root of the tree."""

    blame = Blame.DEVICE

    def __init__(self, device: str, problem: str, remedy: str) -> None:
        self.device, self.problem, self.remedy = device, problem, remedy
        super().__init__(f"{device}: {problem}; {remedy}")


class SettingError(DriverError, ValueError):
    """A setting that cannot work."""

    blame = Blame.OPERATOR


class WiringError(DriverError):
    """There is no such device, or another one, or no way to it."""

    blame = Blame.OPERATOR


class RefusedError(DriverError, ValueError):
    """A command that may not be sent to any device."""

    blame = Blame.CALLER


class StateError(DriverError):
    """Something was asked for out of order."""

    blame = Blame.CALLER


class SilentError(DriverError):
    """The device does not answer."""


class LateError(SilentError):
    """The device may well be in order: its answer was there when nobody waited any more, or nobody could listen."""

    blame = Blame.HOST


class GarbledError(DriverError):
    """What arrives has made no sense for too long."""


class DeviceFaultError(DriverError):
    """The device reports a fault of its own."""
