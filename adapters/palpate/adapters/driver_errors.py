"""From a driver's errors to the core's: what happened stays, and whose fault it is."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from palpate.core.errors import CommandError, ConfigurationError, DeviceError, LifecycleError, PalpateError
from palpate.drivers.errors import DriverError, RefusedError, SettingError, StateError


def translated(error: DriverError, device: str) -> PalpateError:
    """The core's error for a driver's."""
    told = f"{error.problem}; {error.remedy} (fault of the {error.blame.value})"
    if isinstance(error, SettingError):
        return ConfigurationError(device, error.problem, error.remedy)
    if isinstance(error, RefusedError):
        return CommandError(error.problem, error.remedy)
    if isinstance(error, StateError):
        return LifecycleError(device, "in another state", error.problem, error.remedy)
    return DeviceError(device, told)


@contextmanager
def translating(device: str) -> Iterator[None]:
    """While inside, a driver's error comes out as the core's."""
    try:
        yield
    except DriverError as error:
        raise translated(error, device) from error
