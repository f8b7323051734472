"""Symbolic conversion, which maps features to named regions (paper, 3.3 and 5.2).

Regions are defined by thresholds from task knowledge, by a random partition, or by unsupervised clustering.
"""

from __future__ import annotations

from abc import abstractmethod
from bisect import bisect_left, bisect_right
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise, product
from math import prod
from typing import ClassVar, Protocol, runtime_checkable

import numpy as np
from typing_extensions import override

from palpate.core.errors import ConfigurationError, require_whole
from palpate.core.perception.signal import MOST_SEED, Array, Normalisation, require_finite, samples
from palpate.core.ports import Matrix, Names, Settings, fitted

MOST_SYMBOLS = 100_000
"""Maximum number of symbols; with more, a table of values could not be learned."""
_TABLE = "perception.symboliser"


@runtime_checkable
class Symboliser(Protocol):
    """Interface for mapping a feature vector to a symbol."""

    @property
    @abstractmethod
    def features(self) -> tuple[str, ...]:
        """Return the expected feature names, in order."""

    @property
    @abstractmethod
    def symbols(self) -> tuple[str, ...]:
        """Return readable symbol names; symbol ``i`` is ``symbols[i]``."""

    @abstractmethod
    def symbol(self, features: tuple[float, ...]) -> int:
        """Return the symbol for a feature vector.

        Raises:
            CommandError: A feature is not finite.
        """


@dataclass(frozen=True)
class Thresholds(Settings):
    """Symboliser with bands for each feature; a symbol combines the bands, with the first feature most significant.

    With two thresholds the bands are ``-``, ``0`` and ``+``, for example ``"x- y0"``; otherwise they are numbered from
    0, for example ``"fz:1"``. A value on a threshold belongs to the band nearer to the middle, so the middle band
    between -t and t is ``|value| <= t``; with a single threshold it belongs to the upper band.

    Attributes:
        thresholds: Thresholds for each feature in ascending order, in the feature's unit.

    Raises:
        ConfigurationError: The thresholds do not ascend, or there is not one list per feature.
    """

    TABLE: ClassVar[str] = _TABLE

    features: Names
    thresholds: Matrix

    @override
    def check(self) -> None:
        rising = all(row and all(low < high for low, high in pairwise(row)) for row in self.thresholds)
        accepted = f"a list of rising numbers for each of the {len(self.features)} features"
        self.require("thresholds", rising and len(self.thresholds) == len(self.features), accepted)
        few = prod(len(row) + 1 for row in self.thresholds) <= MOST_SYMBOLS
        self.require("thresholds", few, f"at most {MOST_SYMBOLS} symbols in all")

    @cached_property
    def symbols(self) -> tuple[str, ...]:
        """Return the names of the band combinations."""
        bands = [
            [f"{name}{sign}" for sign in "-0+"] if len(cuts) == 2 else [f"{name}:{i}" for i in range(len(cuts) + 1)]
            for name, cuts in zip(self.features, self.thresholds, strict=True)
        ]
        return tuple(" ".join(one) for one in product(*bands))

    @cached_property
    def _cuts(self) -> tuple[tuple[Sequence[float], Sequence[float], int], ...]:
        # A value equal to a threshold below the middle is in the upper band, above the middle in the lower one.
        halves = [(cuts[: (len(cuts) + 1) // 2], cuts[(len(cuts) + 1) // 2 :]) for cuts in self.thresholds]
        return tuple((low, high, len(low + high) + 1) for low, high in halves)

    @classmethod
    def of(cls, thresholds: Mapping[str, Sequence[float]]) -> Thresholds:
        """Create thresholds from a mapping such as ``{"x": (-1e-3, 1e-3), "y": (-1e-3, 1e-3)}``."""
        return cls(tuple(thresholds), tuple(tuple(cuts) for cuts in thresholds.values()))

    def symbol(self, features: tuple[float, ...]) -> int:
        """Return the symbol for the features' band combination."""
        require_finite("features", features)
        number = 0
        for value, (low, high, bands) in zip(features, self._cuts, strict=True):
            number = number * bands + bisect_right(low, value) + bisect_left(high, value)
        return number

    @property
    def middle(self) -> int | None:
        """Return the symbol for the middle bands, or None if a feature has no middle band."""
        if any(bands % 2 == 0 for _, _, bands in self._cuts):
            return None
        return len(self.symbols) // 2


@dataclass(frozen=True)
class GatedThresholds(Settings):
    """Symboliser that uses the outer features, and the inner ones only if all outer ones are in their middle band.

    With x, y as outer and tx, ty as inner features and two thresholds each, these are the 8 + 9 = 17 symbols of the
    paper (5.2): the torque is used if the position is not distinctive. The outer symbols come first.

    Attributes:
        outer: Thresholds for the features that are checked first, an even number for each.
        inner: Thresholds for the features that follow them in the feature vector.

    Raises:
        ConfigurationError: An outer feature has no middle band, or a feature is both outer and inner.
    """

    TABLE: ClassVar[str] = _TABLE

    outer: Thresholds
    inner: Thresholds

    @override
    def check(self) -> None:
        self.require("outer", self.outer.middle is not None, "an even number of thresholds for each feature")
        fitted(f"{_TABLE}.features", self.features, Names)

    @cached_property
    def features(self) -> tuple[str, ...]:
        """Return the outer features followed by the inner ones."""
        return self.outer.features + self.inner.features

    @cached_property
    def symbols(self) -> tuple[str, ...]:
        """Return the outer symbols without the middle one, followed by the inner ones."""
        around = self.outer.symbols
        return around[: self._middle] + around[self._middle + 1 :] + self.inner.symbols

    @cached_property
    def _middle(self) -> int:
        return len(self.outer.symbols) // 2

    @classmethod
    def of(cls, outer: Mapping[str, Sequence[float]], inner: Mapping[str, Sequence[float]]) -> GatedThresholds:
        """Create thresholds from two mappings; see :meth:`Thresholds.of`."""
        return cls(Thresholds.of(outer), Thresholds.of(inner))

    def symbol(self, features: tuple[float, ...]) -> int:
        """Return the symbol for the outer features, or for the inner ones if all outer ones are in the middle."""
        require_finite("features", features)
        count = len(self.outer.features)
        region = self.outer.symbol(features[:count])
        if region == self._middle:
            return len(self.outer.symbols) - 1 + self.inner.symbol(features[count:])
        return region - (region > self._middle)


@dataclass(frozen=True)
class NearestPrototype(Settings):
    """Symboliser that uses the number of the nearest prototype (Euclidean, in normalised features).

    Attributes:
        normalisation: Normalisation, (n,), that makes features with different units comparable.
        prototypes: Prototypes in normalised features, (symbols, n).
    """

    TABLE: ClassVar[str] = _TABLE

    features: Names
    normalisation: Normalisation
    prototypes: Matrix
    _word: ClassVar[str] = "prototype"

    @override
    def check(self) -> None:
        width = len(self.features)
        self.require("normalisation", len(self.normalisation.gain) == width, f"a normalisation of {width} features")
        fit = {len(row) for row in self.prototypes} == {width}
        self.require("prototypes", fit, f"one or more rows of {width} finite numbers")

    @cached_property
    def symbols(self) -> tuple[str, ...]:
        """Return the numbered names."""
        return tuple(f"{self._word} {i}" for i in range(len(self.prototypes)))

    @cached_property
    def _prototypes(self) -> Array:
        return np.array(self.prototypes)

    def symbol(self, features: tuple[float, ...]) -> int:
        """Return the number of the nearest prototype; if several tie, the first one."""
        require_finite("features", features)
        apart = self._prototypes - self.normalisation.apply(features)
        return int((apart * apart).sum(axis=1).argmin())


class RandomPartition(NearestPrototype):
    """Symboliser that uses the Voronoi cells of random points; see :class:`NearestPrototype`."""

    _word = "region"

    @classmethod
    def draw(cls, bounds: Mapping[str, tuple[float, float]], regions: int, seed: int) -> RandomPartition:
        """Draw the points uniformly within bounds: the lowest and highest value of each feature, in its unit.

        Distances are relative to the bounds, so that no feature dominates.

        Raises:
            ConfigurationError: The bounds do not ascend, or a number is out of range.
        """
        where = "perception.symboliser.bounds"
        pairs: list[tuple[float, float]] = [
            fitted(f"{where}.{name}", pair, tuple[float, float]) for name, pair in bounds.items()
        ]
        if not pairs or any(low >= high for low, high in pairs):
            raise ConfigurationError(where, dict(bounds), "a lower and a higher number for each feature")
        require_whole(f"{_TABLE}.regions", regions, 2, MOST_SYMBOLS)
        require_whole("perception.seed", seed, 0, MOST_SEED)
        generator = np.random.default_rng(seed)
        normalisation = Normalisation(tuple(low for low, _ in pairs), tuple(1.0 / (high - low) for low, high in pairs))
        return cls(tuple(bounds), normalisation, generator.random((regions, len(pairs))).tolist())


class Clusters(NearestPrototype):
    """Symboliser that uses cells around the k-means centres of samples; see :class:`NearestPrototype`."""

    _word = "cluster"

    @classmethod
    def fit(
        cls, values: Iterable[Sequence[float]] | Array, clusters: int, seed: int, features: Sequence[str]
    ) -> Clusters:
        """Find cluster centres, and number them by the first feature, then by the second, and so on.

        Raises:
            ConfigurationError: There are too few different samples, or a number is out of range.
        """
        chosen: tuple[str, ...] = fitted(f"{_TABLE}.features", features, Names)
        table = samples(values, len(chosen))
        different = len(np.unique(table, axis=0))
        require_whole(f"{_TABLE}.clusters", clusters, 1, min(different, MOST_SYMBOLS))
        require_whole("perception.seed", seed, 0, MOST_SEED)
        normalisation = Normalisation.fit(table)
        from sklearn.cluster import KMeans
        from threadpoolctl import threadpool_limits

        # Multiple threads add in the order in which they finish, which changes the least significant bits.
        with threadpool_limits(limits=1):
            found = KMeans(clusters, n_init=10, random_state=seed).fit(normalisation.apply(table))
        centres = found.cluster_centers_
        return cls(chosen, normalisation, centres[np.lexsort(centres.T[::-1])].tolist())
