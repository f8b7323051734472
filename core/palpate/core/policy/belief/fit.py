"""Fits a touch model to labelled touches: part by part, each to what the others leave, a few times round.

No matrix is solved and no random number drawn, so the same touches give the same model to the last bit.
"""

from collections.abc import Sequence
from math import sqrt
from typing import Any, Final

import numpy as np

from palpate.core.errors import ConfigurationError
from palpate.core.policy.belief.arithmetic import Floats
from palpate.core.policy.belief.model import RINGS_M, SECTORS, Directions, Pair, TouchModel
from palpate.core.policy.belief.touches import Examples, TouchedTrial

FEWEST_TOUCHES: Final = 6
"""Below this many nothing is fitted."""
LAGS: Final = (0.0, 0.2, 0.4, 0.6, 0.8)
"""Shares of the last step by which the torque may be behind."""
_SWEEPS: Final = 8
_CUE_COUNT: Final = 2.0
"""The cue of a ring is shrunk to that of all rings as if so many touches had shown it."""
_RESIDUAL_COUNT: Final = 2.0
"""A residual is shrunk to 0 likewise."""
_NOISE_COUNT: Final = 5.0
"""The noise of a ring is shrunk to that of all rings likewise."""
_BORROWED: Final = 0.1
"""Share of its neighbours' touches that a ring takes for its own."""
_BIAS_TRIALS: Final = 2.0
"""What is believed of the bias beforehand, that it is as large as the noise, is worth so many trials."""
LEAST_NM: Final = 1e-4
"""Nothing is less noisy than this."""


def fit_touch_model(trials: Sequence[TouchedTrial]) -> TouchModel:
    """The touch model that these trials show.

    Raises:
        ConfigurationError: They hold too few touches.
    """
    examples = Examples.of(trials)
    require_touches(len(examples.trial))
    fits = [TouchFit(examples, lag) for lag in LAGS]
    return min(fits, key=lambda fit: fit.pooled).model()


def require_touches(count: int) -> None:
    """Refuse to fit anything to too few touches.

    Raises:
        ConfigurationError: There are fewer than ``FEWEST_TOUCHES``.
    """
    if count < FEWEST_TOUCHES:
        accepted = f"at least {FEWEST_TOUCHES} touches in trials that ended in the hole"
        raise ConfigurationError("touch model", f"{count} touches", accepted)


class TouchFit:
    """The fit at one lag."""

    _residual_count = _RESIDUAL_COUNT

    def __init__(self, examples: Examples, lag: float) -> None:
        self._lag, self._torque, self._trial = lag, examples.torque_Nm, examples.trial
        self._load = examples.load[:, None]
        self._weight = self._load * self._load
        # The torque is that of a place which the tip has already left.
        place = examples.to_hole_m + lag * examples.step_m
        self._at = Directions.of(place[:, 0], place[:, 1])
        self._trials = int(self._trial.max()) + 1
        self._per_trial = np.bincount(self._trial, minlength=self._trials).astype(float)
        self._cues = self._residuals = np.zeros((len(self._torque), 2))
        self.pooled = max(float(np.square(self._torque).mean()), LEAST_NM**2)
        self._bias_variance = self.pooled
        for _ in range(_SWEEPS):
            self._sweep()

    def _sweep(self) -> None:
        self._fit_offset_and_bias(self._torque - self._load * (self._cues + self._residuals))
        left = self._torque - self._offset - self._bias[self._trial]
        # What is borne with a greater load shows more: least squares weight a lever by the load's square.
        self._fit_cue(self._load * left - self._weight * self._residuals)
        self._fit_residual(self._load * left - self._weight * self._cues)
        self._take_left(left - self._load * (self._cues + self._residuals))

    def _take_left(self, unexplained: Floats) -> None:
        self._left = np.square(unexplained).mean(axis=1)
        self.pooled = max(float(self._left.mean()), LEAST_NM**2)

    def _fit_cue(self, weighted: Floats) -> None:
        sums, counts = self._by_ring(self._at.turned_back(weighted)), self._by_ring(self._weight)
        common = sums.sum(axis=0) / (counts.sum() + _CUE_COUNT)
        sums, counts = borrowing(sums), borrowing(counts)
        self._cue = (sums + _CUE_COUNT * common) / (counts + _CUE_COUNT)
        self._cues = self._at.turned(self._at.between(self._cue))

    def _fit_residual(self, weighted: Floats) -> None:
        cells = self._at.ring * SECTORS + self._at.sector
        size, (low, high) = len(RINGS_M) * SECTORS, (1.0 - self._at.share, self._at.share)
        table = np.zeros((size, 3))
        for column, values in enumerate((weighted[:, 0], weighted[:, 1], self._weight[:, 0])):
            table[:, column] = np.bincount(cells, low * values, size)
            table[:, column] += np.bincount(cells + SECTORS, high * values, size)
        means = table[:, :2] / (table[:, 2:] + self._residual_count)
        self._residual = means.reshape(len(RINGS_M), SECTORS, 2)
        self._residuals = self._at.between_cells(self._residual)

    def _fit_offset_and_bias(self, left: Floats) -> None:
        """An offset and a random intercept a trial; the variance of these by expectation maximisation."""
        sums = np.stack([np.bincount(self._trial, left[:, k], self._trials) for k in (0, 1)], axis=1)
        means = sums / self._per_trial[:, None]
        noise = self.pooled / self._per_trial
        # A trial of a hundred touches says no more of the offset than its own bias leaves.
        weights = 1.0 / (self._bias_variance + noise)
        self._offset = (weights[:, None] * means).sum(axis=0) / weights.sum()
        shrink = self._bias_variance * weights
        self._bias = shrink[:, None] * (means - self._offset)
        spread = float((np.square(self._bias).mean(axis=1) + shrink * noise).sum())
        self._bias_variance = self._shrunk_variance(spread)

    def _shrunk_variance(self, spread: float) -> float:
        before = _BIAS_TRIALS * self.pooled
        return max((spread + before) / (self._trials + _BIAS_TRIALS), LEAST_NM**2)

    def _by_ring(self, values: Floats) -> Floats:
        """Sums of values (n, k) by ring, each value shared between the two rings it lies between."""
        rings = len(RINGS_M)
        columns = [
            np.bincount(self._at.ring, (1.0 - self._at.share) * column, rings)
            + np.bincount(self._at.ring + 1, self._at.share * column, rings)
            for column in values.T
        ]
        return np.stack(columns, axis=1)

    def model(self) -> TouchModel:
        """What was fitted."""
        return TouchModel(**self._parts())

    def _parts(self) -> dict[str, Any]:
        counts = self._by_ring(np.ones((len(self._left), 1)))[:, 0]
        variance = (self._by_ring(self._left[:, None])[:, 0] + _NOISE_COUNT * self.pooled) / (counts + _NOISE_COUNT)
        return {
            "lag": self._lag,
            "offset_Nm": as_pair(self._offset),
            "cue_Nm": tuple(map(as_pair, self._cue)),
            "residual_Nm": tuple(tuple(map(as_pair, ring)) for ring in self._residual),
            "noise_Nm": tuple(sqrt(max(float(value), LEAST_NM**2)) for value in variance),
            "bias_Nm": sqrt(self._bias_variance),
            "touches": len(self._left),
        }


def borrowing(table: Floats) -> Floats:
    """A table by rings (rings, k), each with a share of its neighbours'."""
    lent = _BORROWED * table
    table = table.copy()
    table[1:] += lent[:-1]
    table[:-1] += lent[1:]
    return table


def as_pair(values: Floats) -> Pair:
    """Two numbers, (2,), as a pair."""
    return float(values[0]), float(values[1])
