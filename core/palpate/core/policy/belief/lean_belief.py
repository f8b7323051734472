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
        leans = (
            (1.0 - regrip_share, model.offset_Nm, model.bias_Nm),
            (regrip_share, (0.0, 0.0), model.spread_Nm),
        )
        rows = []
        for share, (x, y), spread in leans:
            precision = 1.0 / (spread * spread)
            known = log(share) + log(precision) - 0.5 * precision * (x * x + y * y)
            rows.append((known, precision, precision * x, precision * y))
        known, precision, *pull = np.array(rows).T[:, :, None, None]
        self.leans = known, precision, pull

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
        # what an upright tool leaves, squared, with the variances. Zeros that are written, for memory that was never
        # used is slow the first time, and that would be in a decision.
        self._sums = np.full((6, *log_prior.shape), 0.0)

    @override
    def foresee(self, row: int, column: int) -> None:
        self._table.look_ahead(row, column)

    @override
    def feel(self, row: int, column: int, torque_Nm: tuple[float, float], load: float) -> None:
        # In place and two at a time: a pass over the places costs more for its call than for its numbers.
        table = self._table.at(row, column)
        left, gains, (c, s), precision, log_variance = table[:2], table[2:4], table[4:6], table[6], table[7]
        left *= -load
        left += np.array(torque_Nm)[:, None, None]
        gains *= load
        gains += 1.0
        # What the lean's parts along and across the heading pull with.
        pulls, turned = left * c, left * s
        pulls[0] += turned[1]
        pulls[1] -= turned[0]
        weighted = precision * gains
        pulls *= weighted
        gains *= weighted
        along, across = gains
        in_x = along - across
        in_x *= c
        news = np.empty_like(self._sums)
        np.multiply(in_x, s, out=news[1])
        in_x *= c
        np.add(in_x, across, out=news[0])
        np.subtract(along, in_x, out=news[2])
        np.multiply(pulls, s, out=turned)
        pulls *= c
        np.subtract(pulls[0], turned[1], out=news[3])
        np.add(turned[0], pulls[1], out=news[4])
        left *= left
        square = np.add(left[0], left[1], out=news[5])
        square *= precision
        square += log_variance
        self._sums *= self._kept
        self._sums += news

    @override
    def evidence(self) -> Floats:
        xx, xy, yy, x, y, square = self._sums
        known, precision, pull = self._table.leans
        # By each lean at once: known + (b u u - 2 xy u v + a v v) / (2 det), with a width of 1 / sqrt(det).
        a, b, u, v = xx + precision, yy + precision, x + pull[0], y + pull[1]
        width = a * b
        width -= xy * xy
        crossed = u * v
        crossed *= 2.0 * xy
        u *= u
        u *= b
        u -= crossed
        v *= v
        v *= a
        u += v
        u *= 0.5
        u /= width
        u += known
        np.sqrt(width, out=width)
        np.divide(1.0, width, out=width)
        gap = u[0] - u[1]
        # The sum of both, by the greater one.
        likely = exponential(np.copysign(gap, -1.0)) * width[::-1]
        likely += width
        evidence: Floats = np.maximum(u[0], u[1])
        evidence += logarithm(np.where(gap >= 0.0, likely[0], likely[1]))
        evidence -= 0.5 * square
        return evidence
