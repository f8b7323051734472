"""What decorators over device ports have in common: the life of the device is the life of what it decorates."""

from __future__ import annotations

from types import TracebackType
from typing import Self

from palpate.core.lifecycle import Life
from palpate.core.ports import Device


class DeviceDecorator:
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

    def __enter__(self) -> Self:
        try:
            self.configure()
            self.activate()
        except BaseException:
            self.close()
            raise
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()
