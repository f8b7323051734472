"""A belief over the hole's place that finds out on the way how the tool leans."""

from __future__ import annotations

from collections.abc import Sequence
from math import log

import numpy as np
from typing_extensions import override

from palpate.core.policy.belief.arithmetic import Floats, exponential, logarithm
from palpate.core.policy.belief.lean import LeanModel
from palpate.core.policy.belief.model import Directions, TouchModel
from palpate.core.policy.belief.places import PlaceBelief, Places, TouchTable


class LeanTable(TouchTable):
    """A touch model laid out over all displacements that there can be between two places, to be looked up fast.

    Args:
        regrip_share: How likely the tool leans otherwise than in the last trials.
    """

    def __init__(self, model: LeanModel, places: Places, regrip_share: float) -> None:
        self._gain = np.array(model.gain)
        super().__init__(model, places)
        self.leans = (
            (1.0 - regrip_share, model.offset_Nm, model.bias_Nm),
            (regrip_share, (0.0, 0.0), model.spread_Nm),
        )

    @override
    def _columns(self, model: TouchModel, directions: Directions) -> Sequence[Floats]:
        """Torque of an upright tool, gains, headings, (2,) each; precision; logarithm of both components' variances."""
        upright_Nm, variance = TouchModel.expected_Nm(model, directions), model.variance(directions)
        pairs = np.concatenate((upright_Nm, directions.between(self._gain), directions.unit), axis=1).T.copy()
        return *pairs, 1.0 / variance, 2.0 * logarithm(variance)

    @override
    def begin(self, log_prior: Floats, kept: float) -> PlaceBelief:
        return LeanBelief(self, log_prior, kept)


class LeanBelief(PlaceBelief):
    """Evidence of one trial's torques for each place.

    The torque of the lean is integrated out: the touches are linear in it, and beforehand it is either about that of
    the last trials or anything, each normal. So the evidence has a closed form in six running sums.
    """

    def __init__(self, table: LeanTable, log_prior: Floats, kept: float) -> None:
        super().__init__(log_prior, kept)
        self._table = table
        # Over the touches: the precision with which they show the lean, xx, xy and yy, the lean times it, x and y, and
        # what an upright tool leaves, squared, with the variances.
        self._sums = [np.zeros(log_prior.shape) for _ in range(6)]

    @override
    def feel(self, row: int, column: int, torque_Nm: tuple[float, float], load: float) -> None:
        expected_x, expected_y, gain_along, gain_across, c, s, precision, log_variance = self._table.at(row, column)
        x, y = torque_Nm[0] - load * expected_x, torque_Nm[1] - load * expected_y
        along, across = 1.0 + load * gain_along, 1.0 + load * gain_across
        pull_along, pull_across = precision * along * (c * x + s * y), precision * across * (c * y - s * x)
        along, across = precision * along * along, precision * across * across
        difference = along - across
        in_x = difference * c
        news = (
            in_x * c + across,
            in_x * s,
            along - in_x * c,
            pull_along * c - pull_across * s,
            pull_along * s + pull_across * c,
            precision * (x * x + y * y) + log_variance,
        )
        for total, new in zip(self._sums, news, strict=True):
            total *= self._kept
            total += new

    @override
    def evidence(self) -> Floats:
        xx, xy, yy, x, y, square = self._sums
        fits, widths = [], []
        for share, (mean_x, mean_y), spread in self._table.leans:
            precision = 1.0 / (spread * spread)
            a, b, u, v = xx + precision, yy + precision, x + precision * mean_x, y + precision * mean_y
            det = a * b - xy * xy
            known = log(share) + log(precision) - 0.5 * precision * (mean_x * mean_x + mean_y * mean_y)
            fits.append(known + 0.5 * (b * (u * u) - 2.0 * xy * (u * v) + a * (v * v)) / det)
            widths.append(1.0 / np.sqrt(det))
        gap = fits[0] - fits[1]
        # The sum of both, by the greater one.
        less = exponential(-np.abs(gap))
        likely = np.where(gap >= 0.0, widths[0] + less * widths[1], widths[1] + less * widths[0])
        evidence: Floats = np.maximum(*fits) + logarithm(likely) - 0.5 * square
        return evidence
