"""The SDO server of an emulated drive: expedited transfers, and an abort for everything else.

Standard knowledge, CiA 301: request and answer are 8 bytes, command, index, sub-index and up to 4 bytes of data.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from typing import Final

from palpate.simulation.emulators.cia402.objects import ABORT_COMMAND, ObjectDictionary, SdoAbortError

_FRAME: Final = struct.Struct("<BHB4s")
_ABORT: Final = struct.Struct("<BHBI")

_KIND: Final = 0b1110_0000
_DOWNLOAD: Final = 0b0010_0000
_UPLOAD: Final = 0b0100_0000
_ABORTED: Final = 0b1000_0000
_DOWNLOADED: Final = 0b0110_0000
_EXPEDITED_WITH_SIZE: Final = 0b0000_0011
_EXPEDITED: Final = 0b0000_0010


def answer(request: bytes, objects: ObjectDictionary, written: Callable[[int], None]) -> bytes | None:
    """What the server says to a request; None where it says nothing.

    Args:
        request: Payload of the frame.
        objects: Read and written here.
        written: Told the index of each object that was written.
    """
    if len(request) != _FRAME.size:
        return None
    command, index, subindex, data = _FRAME.unpack(request)
    try:
        if command & _KIND == _UPLOAD:
            found = objects.entry(index, subindex).encode()
            size_bits = (4 - len(found)) << 2 | _EXPEDITED_WITH_SIZE
            return _FRAME.pack(_UPLOAD | size_bits, index, subindex, found)
        if command & _KIND == _DOWNLOAD and command & _EXPEDITED:
            # Without the size bit all four bytes count.
            unused = command >> 2 & 0b11 if command & 0b1 else 0
            objects.write(index, subindex, data[: 4 - unused])
            written(index)
            return _FRAME.pack(_DOWNLOADED, index, subindex, b"")
        if command & _KIND == _ABORTED:
            return None
        raise SdoAbortError(ABORT_COMMAND)
    except SdoAbortError as abort:
        return _ABORT.pack(_ABORTED, index, subindex, abort.code)
