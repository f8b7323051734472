"""Fit a contact model to labelled contacts by repeatedly fitting each part to the residual left by the others.

The fit solves no matrix equation and draws no random numbers, so the same contacts always give a bit-identical model.
"""

from collections.abc import Sequence
from math import sqrt
from typing import Final

import numpy as np

from palpate.core.errors import ConfigurationError
from palpate.core.policy.belief.arithmetic import Floats
from palpate.core.policy.belief.contacts import ContactTrial, Examples
from palpate.core.policy.belief.model import RINGS_M, SECTORS, ContactModel, Directions, Pair

MIN_CONTACTS: Final = 6
"""Minimum number of contacts for a fit."""
_LAGS: Final = (0.0, 0.2, 0.4, 0.6, 0.8)
"""Torque lags to try, as fractions of the last step."""
_SWEEPS: Final = 8
_CUE_COUNT: Final = 2.0
"""Weight, in contacts, with which a ring's cue is shrunk towards the cue for all rings."""
_RESIDUAL_SHARE: Final = 0.12
"""Prior standard deviation of the asymmetric residual, divided by that of the torques overall."""
_GAIN: Final = 0.5
"""Prior standard deviation of a gain."""
_UPRIGHT_TRIALS: Final = 1.0
"""Number of tilt-free trials assumed before the first trial."""
_RECENT: Final = 0.7
"""Weight of a trial's tilt, divided by that of the next trial, because the latest grip is the most likely."""
_NOISE_COUNT: Final = 5.0
"""Weight, in contacts, with which a ring's noise is shrunk towards the noise in all rings."""
_BORROWED: Final = 0.1
"""Fraction of the contacts in neighbouring rings that a ring also uses."""
_BIAS_TRIALS: Final = 2.0
"""Weight, in trials, of the prior on the bias, whose variance is that of the noise."""
_LEAST_NM: Final = 1e-4
"""Lower bound on a standard deviation."""


def fit_contact_model(trials: Sequence[ContactTrial]) -> ContactModel:
    """Fit a contact model to the given trials.

    Raises:
        ConfigurationError: The trials have fewer than ``MIN_CONTACTS`` contacts.
    """
    examples = Examples.of(trials)
    if (count := len(examples.trial)) < MIN_CONTACTS:
        accepted = f"at least {MIN_CONTACTS} contacts in trials that ended in the hole"
        raise ConfigurationError("contact model", f"{count} contacts", accepted)
    return min((_ModelFit(examples, lag) for lag in _LAGS), key=lambda fit: fit.pooled).model()


class _ModelFit:
    """Contact model fit for a given lag."""

    def __init__(self, examples: Examples, lag: float) -> None:
        self._gain = np.zeros((len(RINGS_M), 2))
        self._offset = np.zeros(2)
        self._spread_Nm = max(sqrt(float(np.square(examples.torque_Nm).mean())), _LEAST_NM)
        self._lag, self._torque, self._trial = lag, examples.torque_Nm, examples.trial
        self._load = examples.load[:, None]
        self._weight = self._load * self._load
        # The torque belongs to a position that the tip has already left.
        place = examples.to_hole_m + lag * examples.step_m
        self._at = Directions.of(place[:, 0], place[:, 1])
        self._trials = int(self._trial.max()) + 1
        self._cues = self._residuals = np.zeros((len(self._torque), 2))
        self.pooled = max(float(np.square(self._torque).mean()), _LEAST_NM**2)
        self._bias_variance = self.pooled
        for _ in range(_SWEEPS):
            self._sweep()

    def _sweep(self) -> None:
        gains = self._at.between(self._gain)
        self._fit_tilts(self._torque - self._load * (self._cues + self._residuals), 1.0 + self._load * gains)
        tilt = self._bias[self._trial]
        facing = self._at.turned_back(tilt)
        left = self._torque - tilt
        swayed = left - self._load * self._at.turned(gains * facing)
        # Contacts with a greater load are more informative: least squares weights a lever by the squared load.
        self._fit_cue(self._load * swayed - self._weight * self._residuals)
        rest = self._at.turned_back(left - self._load * (self._cues + self._residuals))
        shown, counts = self._by_ring(self._load * facing * rest), self._by_ring(self._weight * facing * facing)
        self._gain = _borrowing(shown) / (_borrowing(counts) + self.pooled / _GAIN**2)
        left = left - self._load * self._at.turned(self._at.between(self._gain) * facing)
        self._fit_residual(self._load * left - self._weight * self._cues)
        unexplained = left - self._load * (self._cues + self._residuals)
        self._left = np.square(unexplained).mean(axis=1)
        self.pooled = max(float(self._left.mean()), _LEAST_NM**2)

    def _fit_cue(self, weighted: Floats) -> None:
        sums, counts = self._by_ring(self._at.turned_back(weighted)), self._by_ring(self._weight)
        common = sums.sum(axis=0) / (counts.sum() + _CUE_COUNT)
        sums, counts = _borrowing(sums), _borrowing(counts)
        self._cue = (sums + _CUE_COUNT * common) / (counts + _CUE_COUNT)
        self._cues = self._at.turned(self._at.between(self._cue))

    def _fit_residual(self, weighted: Floats) -> None:
        cells = self._at.ring * SECTORS + self._at.sector
        size, (low, high) = len(RINGS_M) * SECTORS, (1.0 - self._at.share, self._at.share)
        table = np.zeros((size, 3))
        for column, values in enumerate((weighted[:, 0], weighted[:, 1], self._weight[:, 0])):
            table[:, column] = np.bincount(cells, low * values, size)
            table[:, column] += np.bincount(cells + SECTORS, high * values, size)
        count = self.pooled / (_RESIDUAL_SHARE * self._spread_Nm) ** 2
        means = table[:, :2] / (table[:, 2:] + count)
        self._residual = means.reshape(len(RINGS_M), SECTORS, 2)
        self._residuals = self._at.between_cells(self._residual)

    def _fit_tilts(self, left: Floats, gains: Floats) -> None:
        """Fit each trial's tilt as a random intercept; expectation maximisation gives its mean and variance."""
        weights = gains * gains
        xx, xy, yy = (self._by_trial(part) / self.pooled for part in _turned_square(weights, self._at.unit))
        pulls = self._at.turned(gains * self._at.turned_back(left)) / self.pooled
        precision = 1.0 / self._bias_variance
        xx, yy = xx + precision, yy + precision
        x, y = (self._by_trial(pulls[:, k]) + precision * self._offset[k] for k in (0, 1))
        det = xx * yy - xy * xy
        self._bias = np.stack(((yy * x - xy * y) / det, (xx * y - xy * x) / det), axis=1)
        half_trace = 0.5 * (xx + yy)
        trusted = 1.0 - precision / half_trace
        self._offset = (trusted[:, None] * self._bias).sum(axis=0) / (trusted.sum() + _UPRIGHT_TRIALS)
        spread = float((0.5 * np.square(self._bias - self._offset).sum(axis=1) + half_trace / det).sum())
        before = _BIAS_TRIALS * self.pooled
        self._bias_variance = max((spread + before) / (self._trials + _BIAS_TRIALS), _LEAST_NM**2)

    def _by_trial(self, values: Floats) -> Floats:
        return np.bincount(self._trial, values, self._trials).astype(np.float64)

    def _by_ring(self, values: Floats) -> Floats:
        """Sum values, (n, k), by ring, splitting each value between the two nearest rings."""
        rings = len(RINGS_M)
        columns = [
            np.bincount(self._at.ring, (1.0 - self._at.share) * column, rings)
            + np.bincount(self._at.ring + 1, self._at.share * column, rings)
            for column in values.T
        ]
        return np.stack(columns, axis=1)

    def model(self) -> ContactModel:
        """Return the fitted model."""
        recent = np.array([_RECENT**age for age in reversed(range(self._trials))])
        offset = (recent[:, None] * self._bias).sum(axis=0) / recent.sum()
        counts = self._by_ring(np.ones((len(self._left), 1)))[:, 0]
        variance = (self._by_ring(self._left[:, None])[:, 0] + _NOISE_COUNT * self.pooled) / (counts + _NOISE_COUNT)
        return ContactModel(
            lag=self._lag,
            offset_Nm=_as_pair(offset),
            cue_Nm=tuple(map(_as_pair, self._cue)),
            residual_Nm=tuple(tuple(map(_as_pair, ring)) for ring in self._residual),
            noise_Nm=tuple(sqrt(max(float(value), _LEAST_NM**2)) for value in variance),
            bias_Nm=sqrt(self._bias_variance),
            contacts=len(self._left),
            gain=tuple(map(_as_pair, self._gain)),
            spread_Nm=self._spread_Nm,
        )


def _borrowing(table: Floats) -> Floats:
    """Add a fraction of its neighbours to each ring in a table, (rings, k)."""
    lent = _BORROWED * table
    table = table.copy()
    table[1:] += lent[:-1]
    table[:-1] += lent[1:]
    return table


def _as_pair(values: Floats) -> Pair:
    """Convert two numbers, (2,), to a tuple."""
    return float(values[0]), float(values[1])


def _turned_square(weights: Floats, unit: Floats) -> tuple[Floats, Floats, Floats]:
    """Return weights along and across headings, (n, 2), as symmetric matrices in x and y: xx, xy, yy."""
    c, s = unit[:, 0], unit[:, 1]
    along, across = weights[:, 0], weights[:, 1]
    return along * c * c + across * s * s, (along - across) * c * s, along * s * s + across * c * c
