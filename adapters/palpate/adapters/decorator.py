"""What decorators over device ports have in common: the life of the device is the life of what it decorates."""

from __future__ import annotations

from palpate.core.lifecycle import ActiveInside, Life
from palpate.core.ports import Device


class DeviceDecorator(ActiveInside):
    """Passes the life cycle through.

    Args:
        device: The device underneath.
    """

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

    def configure(self) -> None:
        """See :class:`palpate.core.ports.Device`."""
        self._device.configure()

    def activate(self) -> None:
        """See :class:`palpate.core.ports.Device`."""
        self._device.activate()

    def deactivate(self) -> None:
        """See :class:`palpate.core.ports.Device`."""
        self._device.deactivate()

    def acknowledge_fault(self) -> None:
        """See :class:`palpate.core.ports.Device`."""
        self._device.acknowledge_fault()

    def close(self) -> None:
        """See :class:`palpate.core.ports.Device`."""
        self._device.close()
