"""From a driver's errors to the core's: what happened stays."""

from collections.abc import Iterator
from contextlib import contextmanager

from palpate.core.errors import CommandError, ConfigurationError, DeviceError, LifecycleError, PalpateError
from palpate.drivers.errors import DriverError, RefusedError, SettingError, StateError


def told(error: DriverError, device: str = "") -> str:
    """What happened, to which part of the device, and what to do; without the device's own name."""
    part = "" if error.device == "arm" or (device and error.device.startswith(device)) else f"{error.device}: "
    return f"{part}{error.problem}; {error.remedy}"


def translated(error: DriverError, device: str) -> PalpateError:
    """The core's error for a driver's."""
    if isinstance(error, SettingError):
        return ConfigurationError(device, error.problem, error.remedy)
    if isinstance(error, RefusedError):
        return CommandError(error.problem, error.remedy)
    if isinstance(error, StateError):
        return LifecycleError(device, "in another state", error.problem, error.remedy)
    return DeviceError(device, told(error, device))


@contextmanager
def translating(device: str) -> Iterator[None]:
    """While inside, a driver's error comes out as the core's."""
    try:
        yield
    except DriverError as error:
        raise translated(error, device) from error
