"""Command frames: ``AA | address | (n << 4) | code | n data bytes | sum``. FACT: libnmc, PyLabRobot.

The sum is that of all bytes but the first, modulo 256; multi-byte fields are little-endian; n is 15 at most.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from palpate.drivers.errors import RefusedError
from palpate.drivers.nmc.flags import UNANSWERED, Code

HEADER: Final = 0xAA
FRAME_OVERHEAD_BYTES: Final = 4
MAX_DATA_BYTES: Final = 15
EVERYBODY: Final = 0xFF
"""Group address to which every module listens after power-up."""
GROUP_BIT: Final = 0x80


def checksum(data: bytes) -> int:
    """Sum of the bytes modulo 256."""
    return sum(data) & 0xFF


def refused(problem: str) -> RefusedError:
    """The error for a command that this protocol cannot carry or no motor should get."""
    return RefusedError("NMC bus", problem, "correct the caller; nothing was sent")


@dataclass(frozen=True, slots=True)
class Command:
    """What one frame asks a module, without the address.

    Attributes:
        code: The command.
        data: Its data bytes, 15 at most.

    Raises:
        RefusedError: Too many data bytes.
    """

    code: Code
    data: bytes = b""

    def __post_init__(self) -> None:
        if len(self.data) > MAX_DATA_BYTES:
            raise refused(f"{self.code.name} with {len(self.data)} data bytes, {MAX_DATA_BYTES} at most")

    @property
    def size_bytes(self) -> int:
        """Bytes of the frame on the wire."""
        return FRAME_OVERHEAD_BYTES + len(self.data)

    @property
    def is_answered(self) -> bool:
        """Whether the module that is addressed alone sends a reply."""
        return self.code not in UNANSWERED

    def frame(self, address: int) -> bytes:
        """The frame for that address.

        Raises:
            RefusedError: The address is not one byte.
        """
        if not 0 <= address <= 0xFF:
            raise refused(f"address {address} is not one byte")
        body = bytes((address, len(self.data) << 4 | self.code)) + self.data
        return bytes((HEADER,)) + body + bytes((checksum(body),))


def find_frame(data: bytes) -> tuple[int, Command] | None:
    """The first whole command frame in the bytes, as (address, command), or None.

    A host that receives command frames hears another master, or itself.
    """
    for start, byte in enumerate(data):
        if byte != HEADER or len(data) < start + FRAME_OVERHEAD_BYTES:
            continue
        end = start + FRAME_OVERHEAD_BYTES + (data[start + 2] >> 4)
        body = data[start + 1 : end - 1]
        if end <= len(data) and checksum(body) == data[end - 1]:
            return body[0], Command(Code(body[1] & 0x0F), bytes(body[2:]))
    return None
