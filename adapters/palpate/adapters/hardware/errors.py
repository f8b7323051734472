"""Translation of driver errors into core errors with the same content."""

from collections.abc import Iterator
from contextlib import contextmanager

from palpate.core.errors import CommandError, DeviceError, DeviceSettingError, LifecycleError, PalpateError
from palpate.drivers.errors import DriverError, RefusedError, SettingError, StateError


def message_of(error: DriverError, device: str = "") -> str:
    """Return the problem, the affected part of the device and the remedy, but not the device's name."""
    part = "" if error.device == "arm" or (device and error.device.startswith(device)) else f"{error.device}: "
    return f"{part}{error.problem}; {error.remedy}"


def translated(error: DriverError, device: str) -> PalpateError:
    """Return the core error for a driver error."""
    if isinstance(error, SettingError):
        return DeviceSettingError(device, message_of(error, device))
    if isinstance(error, RefusedError):
        return CommandError(error.problem, error.remedy)
    if isinstance(error, StateError):
        return LifecycleError(device, "in another state", error.problem, error.remedy)
    return DeviceError(device, message_of(error, device))


@contextmanager
def translating(device: str) -> Iterator[None]:
    """Translate driver errors raised in the context into core errors."""
    try:
        yield
    except DriverError as error:
        raise translated(error, device) from error
