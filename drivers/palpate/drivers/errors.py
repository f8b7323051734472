"""Hierarchy of the errors that drivers raise; the adapters translate them for the core.

::

    DriverError                     states the device, what happened, and what to do
    ├── SettingError                a setting that cannot work
    ├── WiringError                 no device, the wrong one, wrong baud rate, no permission
    ├── RefusedError                a command that no device may receive (NaN, beyond limits)
    ├── StateError                  a request out of order
    ├── SilentError                 the device does not answer, stops answering, or its cable is cut
    │   └── LateError               it answers too late, or this computer was delayed
    ├── GarbledError                its data have been invalid for too long
    └── DeviceFaultError            the device reports its own fault and waits for a person

Malformed bytes do not raise errors: a codec counts them and continues.
"""


class DriverError(Exception):
    """Base class of all driver errors."""

    def __init__(self, device: str, problem: str, remedy: str) -> None:
        self.device, self.problem, self.remedy = device, problem, remedy
        super().__init__(f"{device}: {problem}; {remedy}")


class SettingError(DriverError, ValueError):
    """A setting is invalid or cannot be used."""


class WiringError(DriverError):
    """The device is missing, differs from the configuration, or cannot be reached."""


class RefusedError(DriverError, ValueError):
    """The command must not be sent to any device."""


class StateError(DriverError):
    """The request was made in the wrong state."""


class SilentError(DriverError):
    """The device does not answer."""


class LateError(SilentError):
    """The answer came after the deadline, or this computer was delayed; the device may be intact."""


class GarbledError(DriverError):
    """The received data have been invalid for too long."""


class DeviceFaultError(DriverError):
    """The device reports a fault."""
