"""Base class for decorators of device ports; a decorator shares the life cycle of its device."""

from typing_extensions import override

from palpate.core.ports.devices import Device
from palpate.core.ports.lifecycle import ActiveInside, Life


class DeviceDecorator(ActiveInside):
    """Decorator that forwards life-cycle requests to its device."""

    def __init__(self, device: Device) -> None:
        self._device = device

    @property
    def life(self) -> Life:
        """Return the life-cycle state of the device."""
        return self._device.life

    @property
    def fault(self) -> str | None:
        """The latched fault of the device, or None."""
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
