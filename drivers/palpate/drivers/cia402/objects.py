"""Access to a drive's object dictionary via SDO."""

from collections.abc import Callable
from typing import Final

import can
from canopen.sdo import SdoAbortedError, SdoClient, SdoCommunicationError

from palpate.drivers.errors import DeviceFaultError, SilentError

_UNKNOWN: Final = (0x06020000, 0x06090011)
"""Abort codes for an object or a sub-index that does not exist (FACT: ``canopen`` 2.4.1, ``sdo/exceptions.py``)."""


class Objects:
    """Access to a drive's object dictionary over the bus."""

    def __init__(self, node: int, channel: SdoClient) -> None:
        self.node = node
        self.name = f"drive {node}"
        self._channel = channel

    def read(self, index: int, subindex: int = 0) -> bytes | None:
        """Return an object's bytes, or None if the drive has no such object."""
        return self._try(index, subindex, lambda: self._channel.upload(index, subindex))

    def write(self, index: int, subindex: int, value: int, size: int) -> None:
        """Write an integer in little-endian order; negative values are in two's complement."""
        if not self.write_if_known(index, subindex, value, size):
            problem = f"has no object 0x{index:04X}:{subindex:02X}"
            raise DeviceFaultError(self.name, problem, "this arm needs a drive that has it")

    def write_if_known(self, index: int, subindex: int, value: int, size: int) -> bool:
        """Write an integer like :meth:`write`, but return False if the drive has no such object."""
        data = (value % (1 << 8 * size)).to_bytes(size, "little")
        return self._try(index, subindex, lambda: self._download(index, subindex, data)) is not None

    def _download(self, index: int, subindex: int, data: bytes) -> bytes:
        self._channel.download(index, subindex, data)
        return data

    def _try(self, index: int, subindex: int, transfer: Callable[[], bytes]) -> bytes | None:
        where = f"object 0x{index:04X}:{subindex:02X}"
        try:
            return transfer()
        except SdoAbortedError as error:
            if error.code in _UNKNOWN:
                return None
            remedy = "see the drive's manual for this abort code"
            raise DeviceFaultError(self.name, f"refuses {where}: {error}", remedy) from error
        except (SdoCommunicationError, can.CanError, OSError, RuntimeError) as error:
            remedy = "check its power, its cable and its node number"
            raise SilentError(self.name, f"does not answer about {where}: {error}", remedy) from error
