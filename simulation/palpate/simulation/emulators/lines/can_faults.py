"""Faults of an emulated CAN bus: frames that get lost, doubled, late or wrong."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from palpate.simulation.emulators.lines.can_frame import CanFrame


@dataclass(frozen=True, slots=True)
class BusFaults:
    """Chances, each from 0 to 1, of what happens to a frame; nothing by default.

    A real bus finds a flipped bit by its checksum and sends the frame again, so `corrupt` stands for a faulty adapter.

    Attributes:
        drop: Nobody receives the frame.
        duplicate: Everybody receives it twice.
        corrupt: One bit of the payload is flipped; a frame without payload is left alone.
        delay: The frame waits before it goes on the bus.
        delay_ns: How long it waits, ns.
    """

    drop: float = 0.0
    duplicate: float = 0.0
    corrupt: float = 0.0
    delay: float = 0.0
    delay_ns: int = 20_000_000


class FaultyBus:
    """Draws the fate of each frame.

    Args:
        generator: Source of chance; untouched while all faults are off.
    """

    def __init__(self, generator: np.random.Generator) -> None:
        self.faults = BusFaults()
        """Faults in force; replace the whole value to change them."""
        self._generator = generator

    def wait_ns(self) -> int:
        """Draw how long the next frame waits before it may go on the bus, ns."""
        return self.faults.delay_ns if self._happens(self.faults.delay) else 0

    def arrivals(self, frame: CanFrame) -> list[CanFrame]:
        """Draw what arrives when a frame is sent: nothing, the frame, or two of it, right or wrong."""
        if self._happens(self.faults.drop):
            return []
        if frame.data and self._happens(self.faults.corrupt):
            frame = replace(frame, data=self._flip_one_bit(frame.data))
        return [frame, frame] if self._happens(self.faults.duplicate) else [frame]

    def _happens(self, probability: float) -> bool:
        return probability > 0.0 and bool(self._generator.random() < probability)

    def _flip_one_bit(self, data: bytes) -> bytes:
        byte, bit = divmod(int(self._generator.integers(8 * len(data))), 8)
        return data[:byte] + bytes([data[byte] ^ (1 << bit)]) + data[byte + 1 :]
