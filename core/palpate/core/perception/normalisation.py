"""Scaling of channels of unlike units (m beside N m) to comparable numbers."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np

from palpate.core.errors import ConfigurationError
from palpate.core.perception.checks import Array, samples, vector

_CONSTANT = 1e-12
"""Spread, relative to the largest value, below which a channel only shows rounding."""


@dataclass(frozen=True)
class Normalisation:
    """An offset and a gain per channel: ``(value - offset) * gain``.

    Attributes:
        offset: Subtracted first, (n,), in the channels' units.
        gain: Multiplied afterwards, (n,), not zero, one over the channels' units.

    Raises:
        ConfigurationError: Not finite, of unequal length, or a gain of zero.
    """

    offset: tuple[float, ...]
    gain: tuple[float, ...]
    _offset: Array = field(init=False, repr=False, compare=False)
    _gain: Array = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        offset = vector("perception.normalisation.offset", self.offset)
        gain = vector("perception.normalisation.gain", self.gain, len(offset))
        if 0.0 in gain:
            raise ConfigurationError("perception.normalisation.gain", gain, "numbers other than zero")
        object.__setattr__(self, "offset", offset)
        object.__setattr__(self, "gain", gain)
        object.__setattr__(self, "_offset", np.array(offset))
        object.__setattr__(self, "_gain", np.array(gain))

    @classmethod
    def fit(cls, values: Iterable[Sequence[float]] | Array) -> Normalisation:
        """Mean 0 and variance 1 over samples, (m, n); a constant channel keeps its unit.

        Raises:
            ConfigurationError: Fewer than two samples, or a value is not finite.
        """
        table = samples(values)
        deviation = table.std(axis=0)
        constant = deviation <= _CONSTANT * np.abs(table).max(axis=0)
        gain = 1.0 / np.where(constant, 1.0, deviation)
        return cls(tuple(table.mean(axis=0).tolist()), tuple(gain.tolist()))

    def apply(self, values: Sequence[float] | Array) -> Array:
        """Normalise one vector, (n,), or one per row, (m, n)."""
        scaled: Array = (np.asarray(values) - self._offset) * self._gain
        return scaled
