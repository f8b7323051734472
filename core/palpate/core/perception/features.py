"""Feature extraction, which reduces the measurement vector (paper, 3.2 and 5.2).

There are three methods: selected channels, principal components, and a self-organising map. The last two are fitted to
samples offline with scikit-learn and MiniSom, imported only for fitting. The results are stored as plain numbers,
and extraction needs neither library.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, ClassVar, Protocol, TypeAlias, runtime_checkable

import numpy as np
from typing_extensions import override

from palpate.core.errors import require_whole
from palpate.core.perception.signal import MOST_SEED, Array, Normalisation, require_finite, samples
from palpate.core.ports import CHANNELS, Channels, Matrix, Range, Settings, fitted

Samples: TypeAlias = Iterable[Sequence[float]] | Array

_TABLE = "perception.extractor"
_MOST_ROWS = 1000
_Side: TypeAlias = Annotated[int, Range(1, _MOST_ROWS)]


@runtime_checkable
class FeatureExtractor(Protocol):
    """Interface for mapping a measurement vector to a feature vector."""

    @property
    @abstractmethod
    def names(self) -> tuple[str, ...]:
        """Return the feature names."""

    @abstractmethod
    def extract(self, signal: tuple[float, ...]) -> tuple[float, ...]:
        """Return the features for a measurement vector in SI units, in ``CHANNELS`` order."""


class _OfChannels(Settings):
    """Base class for extractors that use some of the channels."""

    TABLE: ClassVar[str] = _TABLE

    channels: Channels

    @cached_property
    def _indices(self) -> tuple[int, ...]:
        return _indices(self.channels)

    def _require_rows(self, name: str, count: int | None, normalisation: Normalisation) -> None:
        width, table = len(self.channels), getattr(self, name)
        self.require("normalisation", len(normalisation.gain) == width, f"a normalisation of {width} channels")
        fits = {len(row) for row in table} == {width} and count in (None, len(table))
        self.require(name, fits, f"{count or 'one or more'} rows of {width} finite numbers")


@dataclass(frozen=True)
class SelectedChannels(_OfChannels):
    """Feature extractor that selects channels without changing them.

    Attributes:
        channels: Names from ``CHANNELS``, in the required order.

    Raises:
        ConfigurationError: A channel is unknown or listed twice.
    """

    channels: Channels

    @property
    def names(self) -> tuple[str, ...]:
        """Return the channel names."""
        return self.channels

    def extract(self, signal: tuple[float, ...]) -> tuple[float, ...]:
        """Return the selected channels in their own units."""
        return tuple([signal[i] for i in self._indices])


@dataclass(frozen=True)
class PrincipalComponents(_OfChannels):
    """Feature extractor that uses the directions of largest variance in the samples; features are dimensionless.

    Attributes:
        normalisation: Mean and scale of each channel, (n,), because the units differ.
        components: Directions in the normalised channels, (features, n), orthonormal rows.
        channels: Names of the n channels, from ``CHANNELS``.

    Raises:
        ConfigurationError: The shapes do not match.
    """

    normalisation: Normalisation
    components: Matrix
    channels: Channels = CHANNELS

    @override
    def check(self) -> None:
        self._require_rows("components", None, self.normalisation)

    @cached_property
    def _components(self) -> Array:
        return np.array(self.components)

    @classmethod
    def fit(cls, values: Samples, components: int, channels: Sequence[str] = CHANNELS) -> PrincipalComponents:
        """Find the principal components of measurement vectors, (m, 9), in ``CHANNELS`` order.

        Raises:
            ConfigurationError: There are too few samples, or more components than channels or samples.
        """
        chosen = _chosen(channels)
        table = samples(values, len(CHANNELS))[:, _indices(chosen)]
        require_whole(f"{_TABLE}.components", components, 1, min(table.shape))
        normalisation = Normalisation.fit(table)
        from sklearn.decomposition import PCA

        found = PCA(n_components=components, svd_solver="full").fit(normalisation.apply(table))
        return cls(normalisation, found.components_.tolist(), chosen)

    @property
    def names(self) -> tuple[str, ...]:
        """Return the feature names: ``pc1``, ``pc2``, ..."""
        return tuple(f"pc{i + 1}" for i in range(len(self.components)))

    def extract(self, signal: tuple[float, ...]) -> tuple[float, ...]:
        """Return the coordinates along the components, largest variance first."""
        values = np.einsum("ij,j->i", self._components, self.normalisation.apply([signal[i] for i in self._indices]))
        return tuple(values.tolist())


@dataclass(frozen=True)
class SelfOrganisingMap(_OfChannels):
    """Feature extractor that uses the grid coordinates of the map unit nearest to the measurement.

    Attributes:
        normalisation: Mean and scale of each channel, (n,).
        units: Normalised channels of each unit, (rows * columns, n), in row order.
        channels: Names of the n channels, from ``CHANNELS``.

    Raises:
        ConfigurationError: The shapes do not match, or the grid has one unit.
    """

    normalisation: Normalisation
    rows: _Side
    columns: _Side
    units: Matrix
    channels: Channels = CHANNELS

    @override
    def check(self) -> None:
        self.require("rows", self.rows * self.columns > 1, "a grid of two units or more")
        self._require_rows("units", self.rows * self.columns, self.normalisation)

    @cached_property
    def _units(self) -> Array:
        return np.array(self.units)

    @classmethod
    def fit(
        cls,
        values: Samples,
        rows: int,
        columns: int,
        seed: int,
        *,
        iterations: int = 10_000,
        channels: Sequence[str] = CHANNELS,
    ) -> SelfOrganisingMap:
        """Train a map on measurement vectors, (m, 9), in ``CHANNELS`` order.

        The neighbourhood shrinks from half the grid to a third of that. Equal arguments yield the same map; no global
        random state is used.

        Raises:
            ConfigurationError: There are too few samples, or a grid size or setting is out of range.
        """
        chosen = _chosen(channels)
        table = samples(values, len(CHANNELS))[:, _indices(chosen)]
        for name, side in (("rows", rows), ("columns", columns)):
            require_whole(f"{_TABLE}.{name}", side, 1, _MOST_ROWS)
        require_whole("perception.seed", seed, 0, MOST_SEED)
        require_whole("perception.iterations", iterations, 1, MOST_SEED)
        normalisation = Normalisation.fit(table)
        from minisom import MiniSom

        inputs = normalisation.apply(table)
        size = max(rows, columns)
        som = MiniSom(rows, columns, len(chosen), sigma=size / 2, learning_rate=0.5, random_seed=seed)
        som.random_weights_init(inputs)
        som.train(inputs, iterations, random_order=True)
        units = som.get_weights().reshape(rows * columns, len(chosen))
        return cls(normalisation, rows, columns, units.tolist(), chosen)

    @property
    def names(self) -> tuple[str, ...]:
        """Return the feature names."""
        return ("som_row", "som_column")

    def extract(self, signal: tuple[float, ...]) -> tuple[float, ...]:
        """Return the zero-based row and column of the nearest unit.

        Raises:
            CommandError: The measurement is not finite, so no unit is nearest.
        """
        chosen = [signal[i] for i in self._indices]
        require_finite("a measurement vector", chosen)
        apart = self._units - self.normalisation.apply(chosen)
        row, column = divmod(int((apart * apart).sum(axis=1).argmin()), self.columns)
        return (float(row), float(column))


def _indices(channels: Sequence[str]) -> tuple[int, ...]:
    return tuple(CHANNELS.index(name) for name in channels)


def _chosen(channels: Sequence[str]) -> tuple[str, ...]:
    chosen: tuple[str, ...] = fitted(f"{_TABLE}.channels", channels, Channels)
    return chosen
