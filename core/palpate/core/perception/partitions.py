"""Symbols without knowledge of the task: the nearest of some prototypes (paper, 3.3).

The prototypes are drawn at random, or found by clustering.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from palpate.core.errors import ConfigurationError
from palpate.core.perception.checks import (
    Array,
    Matrix,
    integer,
    matrix,
    names,
    require_finite,
    samples,
    vector,
)
from palpate.core.perception.normalisation import Normalisation
from palpate.core.perception.symbols import MOST_SYMBOLS


@dataclass(frozen=True)
class NearestPrototype:
    """The symbol is the number of the nearest prototype (Euclidean, in normalised features).

    Attributes:
        features: Names of the n features.
        normalisation: Makes the features comparable, (n,); they have unlike units.
        prototypes: In normalised features, (symbols, n).

    Raises:
        ConfigurationError: Shapes that do not fit together.
    """

    features: tuple[str, ...]
    normalisation: Normalisation
    prototypes: Matrix
    symbols: tuple[str, ...] = field(init=False, repr=False, compare=False)
    _prototypes: Array = field(init=False, repr=False, compare=False)
    _word: ClassVar[str] = "prototype"

    def __post_init__(self) -> None:
        features = names("perception.symboliser.features", self.features)
        _require_width(self.normalisation, len(features))
        prototypes = matrix("perception.symboliser.prototypes", self.prototypes, len(features))
        object.__setattr__(self, "features", features)
        object.__setattr__(self, "prototypes", prototypes)
        object.__setattr__(self, "symbols", tuple(f"{self._word} {i}" for i in range(len(prototypes))))
        object.__setattr__(self, "_prototypes", np.array(prototypes))

    def symbol(self, features: tuple[float, ...]) -> int:
        """Number of the nearest prototype; of equally near ones the first."""
        require_finite("features", features)
        apart = self._prototypes - self.normalisation.apply(features)
        return int((apart * apart).sum(axis=1).argmin())


class RandomPartition(NearestPrototype):
    """Voronoi cells of random points; see :class:`NearestPrototype`."""

    _word = "region"

    @classmethod
    def draw(cls, bounds: Mapping[str, tuple[float, float]], regions: int, seed: int) -> RandomPartition:
        """Draw the points evenly inside bounds.

        Distances are measured in parts of the bounds, so that no feature outweighs another.

        Args:
            bounds: For each feature, in order, the lowest and highest value, in its unit.
            regions: How many points.
            seed: Equal seeds give equal partitions.

        Raises:
            ConfigurationError: Bounds that do not rise, or a number out of range.
        """
        where = "perception.symboliser.bounds"
        pairs = [vector(f"{where}.{name}", pair, 2) for name, pair in bounds.items()]
        if not pairs or any(low >= high for low, high in pairs):
            raise ConfigurationError(where, dict(bounds), "a lower and a higher number for each feature")
        count = integer("perception.symboliser.regions", regions, 2, MOST_SYMBOLS)
        generator = np.random.default_rng(integer("perception.seed", seed, 0))
        normalisation = Normalisation(tuple(low for low, _ in pairs), tuple(1.0 / (high - low) for low, high in pairs))
        return cls(tuple(bounds), normalisation, generator.random((count, len(pairs))).tolist())


class Clusters(NearestPrototype):
    """Cells around the centres that k-means found in samples; see :class:`NearestPrototype`."""

    _word = "cluster"

    @classmethod
    def fit(
        cls, values: Iterable[Sequence[float]] | Array, clusters: int, seed: int, features: Sequence[str]
    ) -> Clusters:
        """Find cluster centres; they are numbered by the first feature, then the second, ...

        Args:
            values: Feature vectors, (m, n).
            clusters: How many; at most as many as there are different samples.
            seed: Equal seeds give equal clusters.
            features: Names of the n features.

        Raises:
            ConfigurationError: Too few different samples, or a number out of range.
        """
        chosen = names("perception.symboliser.features", features)
        table = samples(values, len(chosen))
        different = len(np.unique(table, axis=0))
        count = integer("perception.symboliser.clusters", clusters, 1, min(different, MOST_SYMBOLS))
        seed = integer("perception.seed", seed, 0)
        normalisation = Normalisation.fit(table)
        from sklearn.cluster import KMeans
        from threadpoolctl import threadpool_limits

        # Several threads add up in the order in which they finish, which moves the last bits.
        with threadpool_limits(limits=1):
            found = KMeans(count, n_init=10, random_state=seed).fit(normalisation.apply(table))
        centres = found.cluster_centers_
        return cls(chosen, normalisation, centres[np.lexsort(centres.T[::-1])].tolist())


def _require_width(value: object, width: int) -> None:
    if not isinstance(value, Normalisation) or len(value.gain) != width:
        raise ConfigurationError("perception.symboliser.normalisation", value, f"a normalisation of {width} features")
