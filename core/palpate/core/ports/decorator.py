"""What decorators over device ports have in common: the life of the device is the life of what it decorates."""

from collections.abc import Callable
from typing import Generic, Protocol, TypeVar

from typing_extensions import override

from palpate.core.ports.devices import Device
from palpate.core.ports.lifecycle import ActiveInside, Life
from palpate.core.ports.values import JointSample, WrenchSample

SampleT = TypeVar("SampleT", WrenchSample, JointSample)
_Read_co = TypeVar("_Read_co", bound=WrenchSample | JointSample, covariant=True)


class Sensor(Device, Protocol[_Read_co]):
    """One of the two ports that are read."""

    def read(self) -> _Read_co:
        """The newest sample."""
        ...


class DeviceDecorator(ActiveInside):
    """Passes the life cycle through."""

    def __init__(self, device: Device) -> None:
        self._device = device

    @property
    def life(self) -> Life:
        """Where in its life the device is."""
        return self._device.life

    @property
    def fault(self) -> str | None:
        """The latched fault, or None."""
        return self._device.fault

    @override
    def configure(self) -> None:
        self._device.configure()

    @override
    def activate(self) -> None:
        self._device.activate()

    def deactivate(self) -> None:
        """End what ``activate`` began."""
        self._device.deactivate()

    def acknowledge_fault(self) -> None:
        """Clear a latched fault of the device."""
        self._device.acknowledge_fault()

    @override
    def close(self) -> None:
        self._device.close()


class SensorDecorator(DeviceDecorator, Generic[SampleT]):
    """Passes the life cycle through, and each sample past a function.

    Args:
        past: Gives what is to be read instead of the sensor's own sample; may raise.
    """

    def __init__(self, sensor: Sensor[SampleT], past: Callable[[SampleT], SampleT]) -> None:
        super().__init__(sensor)
        self._read: Callable[[], SampleT] = sensor.read
        self._past: Callable[[SampleT], SampleT] = past

    def read(self) -> SampleT:
        """What is to be read instead of the sensor's own sample."""
        return self._past(self._read())
