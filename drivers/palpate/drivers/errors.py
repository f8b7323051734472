"""Every error that a driver raises on purpose, in one tree; the adapters translate it for the core.

::

    DriverError                     says the device, what happened, and what to do
    ├── SettingError                a setting that cannot work
    ├── WiringError                 no device, the wrong one, wrong baud rate, no permission
    ├── RefusedError                a command that no device may get (NaN, beyond limits)
    ├── StateError                  a request out of order
    ├── SilentError                 the device does not answer, or no longer, or its cable is cut
    │   └── LateError               it answers too late, or this computer was away
    ├── GarbledError                what it sends makes no sense for too long
    └── DeviceFaultError            the device reports a fault of its own; it waits for a person

Malformed bytes on the wire are none of these: a codec counts them and continues.
"""


class DriverError(Exception):
    """Root of the tree."""

    def __init__(self, device: str, problem: str, remedy: str) -> None:
        self.device, self.problem, self.remedy = device, problem, remedy
        super().__init__(f"{device}: {problem}; {remedy}")


class SettingError(DriverError, ValueError):
    """A setting that cannot work."""


class WiringError(DriverError):
    """There is no such device, or another one, or no way to it."""


class RefusedError(DriverError, ValueError):
    """A command that may not be sent to any device."""


class StateError(DriverError):
    """A request out of order."""


class SilentError(DriverError):
    """The device does not answer."""


class LateError(SilentError):
    """The device may well be in order: its answer came after the deadline, or this computer was away."""


class GarbledError(DriverError):
    """What arrives has made no sense for too long."""


class DeviceFaultError(DriverError):
    """The device reports a fault of its own."""
