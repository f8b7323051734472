"""Feature extraction: keep what matters of the measurement vector (paper, 3.2 and 5.2).

Three ways: channels chosen by knowledge of the task, principal components, a self-organising map.
The last two are fitted to samples offline, with scikit-learn and MiniSom, which are imported only
then; what they found is stored as plain numbers, and extraction needs neither.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Protocol, TypeAlias, runtime_checkable

import numpy as np

from palpate.core.errors import ConfigurationError
from palpate.core.perception.signal import Array, Normalisation, require_finite, samples
from palpate.core.ports import CHANNELS, Matrix, integer, matrix, names

Samples: TypeAlias = Iterable[Sequence[float]] | Array


@runtime_checkable
class FeatureExtractor(Protocol):
    """Measurement vector in, feature vector out."""

    @property
    @abstractmethod
    def names(self) -> tuple[str, ...]:
        """Names of the features."""

    @abstractmethod
    def extract(self, signal: tuple[float, ...]) -> tuple[float, ...]:
        """Features of a measurement vector in the order of ``CHANNELS``, SI units."""


@dataclass(frozen=True)
class SelectedChannels:
    """The features are some of the channels, unchanged.

    Attributes:
        channels: Names out of ``CHANNELS``, in the order wanted.

    Raises:
        ConfigurationError: An unknown channel, or one twice.
    """

    channels: tuple[str, ...]
    _indices: tuple[int, ...] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        channels = names("perception.extractor.channels", self.channels, CHANNELS)
        object.__setattr__(self, "channels", channels)
        object.__setattr__(self, "_indices", _indices(channels))

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the features: those of the channels."""
        return self.channels

    def extract(self, signal: tuple[float, ...]) -> tuple[float, ...]:
        """The selected channels, in their own units."""
        return tuple([signal[i] for i in self._indices])


@dataclass(frozen=True)
class PrincipalComponents:
    """The features are the directions in which the samples varied most, without unit.

    Attributes:
        normalisation: Mean and scale of the channels, (n,); they have unlike units.
        components: Directions in the normalised channels, (features, n), orthonormal rows.
        channels: The channels looked at, n names out of ``CHANNELS``.

    Raises:
        ConfigurationError: Shapes that do not fit together.
    """

    normalisation: Normalisation
    components: Matrix
    channels: tuple[str, ...] = CHANNELS
    _indices: tuple[int, ...] = field(init=False, repr=False, compare=False)
    _components: Array = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        channels = _channels_of(self.channels, self.normalisation)
        components = matrix("perception.extractor.components", self.components, len(channels))
        object.__setattr__(self, "channels", channels)
        object.__setattr__(self, "components", components)
        object.__setattr__(self, "_indices", _indices(channels))
        object.__setattr__(self, "_components", np.array(components))

    @classmethod
    def fit(cls, values: Samples, components: int, channels: Sequence[str] = CHANNELS) -> PrincipalComponents:
        """Find the main directions of measurement vectors, (m, 9) in the order of ``CHANNELS``.

        Raises:
            ConfigurationError: Too few samples, or more components than channels or samples.
        """
        chosen = names("perception.extractor.channels", channels, CHANNELS)
        table = samples(values, len(CHANNELS))[:, _indices(chosen)]
        count = integer("perception.extractor.components", components, 1, min(table.shape))
        normalisation = Normalisation.fit(table)
        from sklearn.decomposition import PCA

        found = PCA(n_components=count, svd_solver="full").fit(normalisation.apply(table))
        return cls(normalisation, found.components_.tolist(), chosen)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the features: ``pc1``, ``pc2``, ..."""
        return tuple(f"pc{i + 1}" for i in range(len(self.components)))

    def extract(self, signal: tuple[float, ...]) -> tuple[float, ...]:
        """Coordinates along the components, most variance first."""
        values = np.einsum("ij,j->i", self._components, self.normalisation.apply([signal[i] for i in self._indices]))
        return tuple(values.tolist())


@dataclass(frozen=True)
class SelfOrganisingMap:
    """The features are the grid coordinates of the unit that resembles the measurement most.

    Attributes:
        normalisation: Mean and scale of the channels, (n,).
        units: Normalised channels that each unit stands for, (rows * columns, n), row by row.
        channels: The channels looked at, n names out of ``CHANNELS``.

    Raises:
        ConfigurationError: Shapes that do not fit together.
    """

    normalisation: Normalisation
    rows: int
    columns: int
    units: Matrix
    channels: tuple[str, ...] = CHANNELS
    _indices: tuple[int, ...] = field(init=False, repr=False, compare=False)
    _units: Array = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        channels = _channels_of(self.channels, self.normalisation)
        rows, columns = _grid(self.rows, self.columns)
        units = matrix("perception.extractor.units", self.units, len(channels), rows * columns)
        object.__setattr__(self, "channels", channels)
        object.__setattr__(self, "units", units)
        object.__setattr__(self, "_indices", _indices(channels))
        object.__setattr__(self, "_units", np.array(units))

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
        """Train a map on measurement vectors, (m, 9) in the order of ``CHANNELS``.

        The neighbourhood starts at half the grid and shrinks to a third of that. Equal arguments give
        an equal map; no global random state is used.

        Raises:
            ConfigurationError: Too few samples, or a grid or setting out of range.
        """
        chosen = names("perception.extractor.channels", channels, CHANNELS)
        table = samples(values, len(CHANNELS))[:, _indices(chosen)]
        rows, columns = _grid(rows, columns)
        seed = integer("perception.seed", seed, 0)
        iterations = integer("perception.iterations", iterations, 1)
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
        """Names of the features."""
        return ("som_row", "som_column")

    def extract(self, signal: tuple[float, ...]) -> tuple[float, ...]:
        """Row and column of the nearest unit, counted from 0.

        Raises:
            CommandError: The measurement is not finite; nothing is nearest to that.
        """
        chosen = [signal[i] for i in self._indices]
        require_finite("a measurement vector", chosen)
        apart = self._units - self.normalisation.apply(chosen)
        row, column = divmod(int((apart * apart).sum(axis=1).argmin()), self.columns)
        return (float(row), float(column))


def _indices(channels: Sequence[str]) -> tuple[int, ...]:
    return tuple(CHANNELS.index(name) for name in channels)


def _channels_of(channels: object, normalisation: object) -> tuple[str, ...]:
    chosen = names("perception.extractor.channels", channels, CHANNELS)
    if not isinstance(normalisation, Normalisation) or len(normalisation.gain) != len(chosen):
        raise ConfigurationError(
            "perception.extractor.normalisation", normalisation, f"a normalisation of {len(chosen)} channels"
        )
    return chosen


def _grid(rows: object, columns: object) -> tuple[int, int]:
    shape = (
        integer("perception.extractor.rows", rows, 1, 1000),
        integer("perception.extractor.columns", columns, 1, 1000),
    )
    if shape == (1, 1):
        raise ConfigurationError("perception.extractor.rows", 1, "a grid of two units or more")
    return shape
