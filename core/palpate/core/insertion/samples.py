"""Averages over new samples only."""

from __future__ import annotations


class Mean:
    """A mean over new samples; a repeated one adds nothing.

    Attributes:
        value: The mean so far; 0 before the first.
        count: Number of samples in it.
    """

    __slots__ = ("count", "value")

    def __init__(self) -> None:
        self.value, self.count = 0.0, 0

    def add(self, number: float, new: bool) -> int:
        """Take a number in if it is new; returns the count."""
        if new:
            self.count += 1
            self.value += (number - self.value) / self.count
        return self.count
