"""The touch of a tool that leans.

::

    torque = load * (cue(distance) turned to the hole's heading + residual(distance, sector)) + noise
             + (1 + load * gain(distance)) times the lean's torque, along and across that heading

A tool that leans in its grip touches with an edge, which gives every touch a torque, the trial's bias; where the hole
is under that edge another one bears. To first order in the lean a round peg leaves nothing else: by symmetry the torque
is linear in that bias, and only its parts along and across the heading can count differently. So whatever one heading
of the lean shows holds for all: a tool that is gripped anew is known but for two numbers, which a belief has
integrated out. A sensor's zero that is off is such a bias without a gain.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import sqrt
from typing import Final

import numpy as np
from typing_extensions import override

from palpate.core.policy.belief.arithmetic import Floats
from palpate.core.policy.belief.fit import LAGS, LEAST_NM, TouchFit, as_pair, borrowing, require_touches
from palpate.core.policy.belief.model import RINGS_M, Directions, Pair, TouchModel
from palpate.core.policy.belief.touches import Examples, TouchedTrial

_RESIDUAL_SHARE: Final = 0.12
"""What breaks the symmetry otherwise is little: its standard deviation beforehand is this share of all torques'."""
_GAIN: Final = 0.5
"""Standard deviation of a gain, as it is believed beforehand."""
_UPRIGHT_TRIALS: Final = 1.0
"""So many trials without a lean are believed to have been before the first."""
_RECENT: Final = 0.7
"""Of the leans so far each counts less by this than the next one: the last grip is the likeliest."""


@dataclass(frozen=True, slots=True)
class LeanModel(TouchModel):
    """A touch model with the lean in it; its offset is that of the last trials.

    Attributes:
        gain: How much more of the lean's torque there is along and across the heading of the hole, at each ring,
            (rings, 2).
        spread_Nm: Standard deviation of each component of a lean's torque of which nothing is known.
    """

    gain: tuple[Pair, ...]
    spread_Nm: float

    @override
    def expected_Nm(self, directions: Directions) -> Floats:
        lean = np.broadcast_to(np.array(self.offset_Nm), directions.unit.shape)
        gained = directions.between(np.array(self.gain)) * directions.turned_back(lean)
        expected: Floats = TouchModel.expected_Nm(self, directions) + directions.turned(gained)
        return expected


def fit_lean_model(trials: Sequence[TouchedTrial]) -> LeanModel:
    """The touch model that these trials show.

    Raises:
        ConfigurationError: They hold too few touches.
    """
    examples = Examples.of(trials)
    require_touches(len(examples.trial))
    return min((_LeanFit(examples, lag) for lag in LAGS), key=lambda fit: fit.pooled).model()


class _LeanFit(TouchFit):
    """The fit at one lag."""

    def __init__(self, examples: Examples, lag: float) -> None:
        self._gain = np.zeros((len(RINGS_M), 2))
        self._offset = np.zeros(2)
        self._spread_Nm = max(sqrt(float(np.square(examples.torque_Nm).mean())), LEAST_NM)
        super().__init__(examples, lag)

    @override
    def _sweep(self) -> None:
        gains = self._at.between(self._gain)
        self._fit_leans(self._torque - self._load * (self._cues + self._residuals), 1.0 + self._load * gains)
        lean = self._bias[self._trial]
        facing = self._at.turned_back(lean)
        left = self._torque - lean
        swayed = left - self._load * self._at.turned(gains * facing)
        self._fit_cue(self._load * swayed - self._weight * self._residuals)
        rest = self._at.turned_back(left - self._load * (self._cues + self._residuals))
        shown, counts = self._by_ring(self._load * facing * rest), self._by_ring(self._weight * facing * facing)
        self._gain = borrowing(shown) / (borrowing(counts) + self.pooled / _GAIN**2)
        left = left - self._load * self._at.turned(self._at.between(self._gain) * facing)
        self._residual_count = self.pooled / (_RESIDUAL_SHARE * self._spread_Nm) ** 2
        self._fit_residual(self._load * left - self._weight * self._cues)
        self._take_left(left - self._load * (self._cues + self._residuals))

    def _fit_leans(self, left: Floats, gains: Floats) -> None:
        """Each trial's lean, as a random intercept; mean and variance of these by expectation maximisation."""
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
        spread = 0.5 * np.square(self._bias - self._offset).sum(axis=1) + half_trace / det
        self._bias_variance = self._shrunk_variance(float(spread.sum()))

    def _by_trial(self, values: Floats) -> Floats:
        return np.bincount(self._trial, values, self._trials).astype(np.float64)

    @override
    def model(self) -> LeanModel:
        recent = np.array([_RECENT**age for age in reversed(range(self._trials))])
        self._offset = (recent[:, None] * self._bias).sum(axis=0) / recent.sum()
        return LeanModel(**self._parts(), gain=tuple(map(as_pair, self._gain)), spread_Nm=self._spread_Nm)


def _turned_square(weights: Floats, unit: Floats) -> tuple[Floats, Floats, Floats]:
    """Weights along and across headings, (n, 2), as symmetric matrices in x and y: xx, xy, yy."""
    c, s = unit[:, 0], unit[:, 1]
    along, across = weights[:, 0], weights[:, 1]
    return along * c * c + across * s * s, (along - across) * c * s, along * s * s + across * c * c
