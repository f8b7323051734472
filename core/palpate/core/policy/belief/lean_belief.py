"""A belief over the hole's place that finds out on the way how the tool leans."""

from __future__ import annotations

from collections.abc import Sequence
from math import log

import numpy as np
from typing_extensions import override

from palpate.core.policy.belief.arithmetic import Floats, bits_of, exponential, logarithm
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
            precision = 0.5 / (spread * spread)
            known = log(share) + log(2.0 * precision) - precision * (x * x + y * y)
            rows.append((known, precision, precision * x, precision * y))
        known, precision, *pull = np.array(rows, places.dtype).T[:, :, None, None]
        self.leans = known, precision, pull
        # Room to reckon in, of pairs of values of all places: memory that is had anew is slow.
        self.work = tuple(np.zeros((6, 2, places.size, places.size), places.dtype))
        found = self._found
        self.found = found[:2], found[2:4], found[4], found[5], found[6], found[7]

    @override
    def _columns(self, model: TouchModel, directions: Directions) -> Sequence[Floats]:
        """Torque of an upright tool, gains, headings, (2,) each; half the precision; logarithm of a variance."""
        upright_Nm, variance = TouchModel.expected_Nm(model, directions), model.variance(directions)
        pairs = np.concatenate((upright_Nm, directions.between(self._gain), directions.unit), axis=1).T.copy()
        return *pairs, 0.5 / variance, logarithm(variance)

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
        # Over the touches, half of each: the precision with which they show the lean, xx, xy and yy, what an upright
        # tool leaves, squared, with the variances, and the lean times its precision, x and y. Zeros that are written,
        # for memory that was never used is slow the first time, and that would be in a decision.
        self._sums = np.full((6, *log_prior.shape), 0.0, log_prior.dtype)
        self._aged = False

    @override
    def foresee(self, row: int, column: int) -> None:
        self._table.look_ahead(row, column)
        self._age()

    def _age(self) -> None:
        """Before a touch, once: those so far count less."""
        if not self._aged:
            self._sums *= self._kept
            self._aged = True

    @override
    def feel(self, row: int, column: int, torque_Nm: tuple[float, float], load: float) -> None:
        # In place and two at a time: a pass over the places costs more for its call than for its numbers.
        self._age()
        self._aged = False
        self._table.at(row, column)
        left, gains, c, s, precision, log_variance = self._table.found
        pulls, turned, news = self._table.work[:3]
        left *= -load
        for part, felt_Nm in zip(left, torque_Nm, strict=True):
            part += felt_Nm
        gains *= load
        gains += 1.0
        # What the lean's parts along and across the heading pull with.
        np.multiply(left, c, out=pulls)
        np.multiply(left, s, out=turned)
        pulls[0] += turned[1]
        pulls[1] -= turned[0]
        weighted = np.multiply(precision, gains, out=turned)
        pulls *= weighted
        gains *= weighted
        along, across = gains
        in_x = np.subtract(along, across, out=turned[0])
        in_x *= c
        np.multiply(in_x, s, out=news[1])
        in_x *= c
        np.add(in_x, across, out=news[0])
        self._sums[:2] += news
        np.subtract(along, in_x, out=news[0])
        left *= left
        square = np.add(left[0], left[1], out=news[1])
        square *= precision
        square += log_variance
        self._sums[2:4] += news
        np.multiply(pulls, s, out=turned)
        pulls *= c
        np.subtract(pulls[0], turned[1], out=news[0])
        np.add(turned[0], pulls[1], out=news[1])
        self._sums[4:] += news

    @override
    def probabilities(self) -> Floats:
        if self._sums.dtype == np.float64:
            return super().probabilities()
        # Without a logarithm that an exponential takes back. By the first lean a place is likelier than by the second
        # by what it is beforehand at most, some e to the 30.
        u, width = self._by_lean()
        gap = np.subtract(u[0], u[1], out=u[0])
        likely = exponential(gap)
        likely *= width[0]
        likely += width[1]
        rest = u[1]
        rest -= self._sums[3]
        rest += self.passed
        rest -= rest.max()
        belief = exponential(rest)
        belief *= likely
        belief /= belief.sum()
        return belief

    def _by_lean(self) -> tuple[Floats, Floats]:
        """By each lean how well each place explains the touches, but for the squares: a logarithm and a factor."""
        xx, xy, yy, _, x, y = self._sums
        known, precision, pull = self._table.leans
        a, b, u, v, width, crossed = self._table.work
        spare = crossed[0]
        # By each lean at once: known + (b u u - 2 xy u v + a v v) / det, with a width of 1 / (2 sqrt(det)).
        np.add(xx, precision, out=a)
        np.add(yy, precision, out=b)
        np.add(x, pull[0], out=u)
        np.add(y, pull[1], out=v)
        np.multiply(a, b, out=width)
        width -= np.multiply(xy, xy, out=spare)
        np.multiply(u, v, out=crossed)
        u *= u
        u *= b
        crossed *= np.add(xy, xy, out=b[0])
        u -= crossed
        v *= v
        v *= a
        u += v
        u /= width
        u += known
        np.sqrt(width, out=width)
        np.divide(0.5, width, out=width)
        return u, width

    @override
    def evidence(self) -> Floats:
        u, width = self._by_lean()
        spare = self._table.work[5][0]
        gap = np.subtract(u[0], u[1], out=spare)
        # The widths of the greater and of the lesser one, exchanged by their bits, all of them where the gap's sign is
        # 1: a choice at each place takes longer.
        greater, lesser = bits_of(width)
        exchanged = greater ^ lesser
        exchanged &= bits_of(gap) >> (8 * gap.itemsize - 1)
        greater ^= exchanged
        lesser ^= exchanged
        np.negative(np.abs(gap, out=gap), out=gap)
        # The sum of both, by the greater one.
        likely = exponential(gap)
        likely *= width[1]
        likely += width[0]
        evidence = logarithm(likely)
        evidence += np.maximum(u[0], u[1], out=spare)
        evidence -= self._sums[3]
        return evidence
