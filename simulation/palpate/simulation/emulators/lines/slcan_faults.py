"""Faults of a USB-CAN adapter: lines that python-can cannot read."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, slots=True)
class LineFaults:
    """Chances, each from 0 to 1, of what happens to a line that reports a frame; nothing by default.

    Attributes:
        bad_hex: One character becomes one that is no hexadecimal digit.
        truncated: The line ends too early.
        not_text: One character becomes a byte that is not UTF-8.
    """

    bad_hex: float = 0.0
    truncated: float = 0.0
    not_text: float = 0.0


class FaultyLines:
    """Spoils lines by chance.

    Args:
        generator: Source of chance; untouched while all faults are off.
    """

    def __init__(self, generator: np.random.Generator) -> None:
        self.faults = LineFaults()
        """Faults in force; replace the whole value to change them."""
        self._generator = generator

    def spoil(self, line: bytes) -> bytes:
        """Return the line as it leaves the adapter; its first character and its end stay as they are."""
        if self._happens(self.faults.bad_hex):
            line = self._replace(line, b"G")
        if self._happens(self.faults.truncated):
            # Two characters are the shortest line that still claims to be a frame.
            line = line[: int(self._generator.integers(2, len(line) - 1))] + line[-1:]
        if self._happens(self.faults.not_text):
            line = self._replace(line, b"\xff")
        return line

    def _happens(self, probability: float) -> bool:
        return probability > 0.0 and bool(self._generator.random() < probability)

    def _replace(self, line: bytes, character: bytes) -> bytes:
        at = int(self._generator.integers(1, len(line) - 1))
        return line[:at] + character + line[at + 1 :]
