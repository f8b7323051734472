"""Base classes of decorators over device ports; a decorator shares the life cycle of its device."""

from collections.abc import Callable
from typing import Generic, Protocol, TypeVar

from typing_extensions import override

from palpate.core.ports.devices import Device
from palpate.core.ports.lifecycle import ActiveInside, Life
from palpate.core.ports.values import JointSample, WrenchSample

SampleT = TypeVar("SampleT", WrenchSample, JointSample)
_Read_co = TypeVar("_Read_co", bound=WrenchSample | JointSample, covariant=True)


class Sensor(Device, Protocol[_Read_co]):
    """One of the two ports with a ``read`` method."""

    def read(self) -> _Read_co:
        """Return the newest sample."""
        ...


class DeviceDecorator(ActiveInside):
    """Forwards the life cycle."""

    def __init__(self, device: Device) -> None:
        self._device = device

    @property
    def life(self) -> Life:
        """Return the life-cycle state of the device."""
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
        """Undo ``activate``."""
        self._device.deactivate()

    def acknowledge_fault(self) -> None:
        """Clear a latched fault of the device."""
        self._device.acknowledge_fault()

    @override
    def close(self) -> None:
        self._device.close()


class SensorDecorator(DeviceDecorator, Generic[SampleT]):
    """Forwards the life cycle and passes each sample through a function.

    Args:
        past: Returns the sample to use in place of the sensor's; may raise.
    """

    def __init__(self, sensor: Sensor[SampleT], past: Callable[[SampleT], SampleT]) -> None:
        super().__init__(sensor)
        self._read: Callable[[], SampleT] = sensor.read
        self._past: Callable[[SampleT], SampleT] = past

    def read(self) -> SampleT:
        """Return the sensor's sample as changed by the function."""
        return self._past(self._read())
