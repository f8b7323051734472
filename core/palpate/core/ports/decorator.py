"""Base class for device port decorators; a decorator shares the life cycle of its device."""

from typing_extensions import override

from palpate.core.ports.lifecycle import ActiveInside, Device, Life


class DeviceDecorator(ActiveInside):
    """Decorator that forwards life-cycle requests to its device."""

    def __init__(self, device: Device) -> None:
        self._device = device

    @property
    @override
    def life(self) -> Life:
        return self._device.life

    @property
    @override
    def fault(self) -> str | None:
        return self._device.fault

    @override
    def configure(self) -> None:
        self._device.configure()

    @override
    def activate(self) -> None:
        self._device.activate()

    @override
    def deactivate(self) -> None:
        self._device.deactivate()

    @override
    def acknowledge_fault(self) -> None:
        self._device.acknowledge_fault()

    @override
    def close(self) -> None:
        self._device.close()
