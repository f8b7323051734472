"""Hierarchy of driver errors; the adapters translate them for the core.

::

    DriverError                     names the device, the problem and the remedy
    ├── SettingError                an invalid setting
    ├── WiringError                 no device, the wrong one, wrong baud rate, no permission
    ├── RefusedError                a command that must not reach any device (NaN, beyond limits)
    ├── StateError                  a request in the wrong state
    ├── SilentError                 the device does not answer, stops answering, or its cable is cut
    │   └── LateError               the device answers too late, or this computer was delayed
    ├── GarbledError                the device has sent invalid data for too long
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
    """The reply came after the deadline, or this computer was delayed; the device may be intact."""


class GarbledError(DriverError):
    """The received data have been invalid for too long."""


class DeviceFaultError(DriverError):
    """The device reports a fault."""
