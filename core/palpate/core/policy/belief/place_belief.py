"""The belief over the hole's place: a grid of places, each with the evidence for it; it finds how the tool leans."""

from __future__ import annotations

from math import log
from typing import Final

import numpy as np

from palpate.core.policy.belief.arithmetic import Floats, exponential, logarithm
from palpate.core.policy.belief.model import Directions, TouchModel
from palpate.core.policy.belief.places import PITCH_M, SINGLE, Places

MISSED: Final = ((0.5, log(0.45)), (1.0, log(0.55)), (1.5, log(0.6)))
"""Of what lies within so many capture widths of the way, weight after it was passed over without a drop: the less the
further off. Of holes in `blind-noise` within these widths 0.15, 0.27 and 0.6 were missed."""


class TouchTable:
    """A touch model laid out over all displacements that there can be between two places, to be looked up fast.

    Args:
        places: Where the hole may be; the tip may be anywhere within them, too.
        regrip_share: How likely the tool leans otherwise than in the last trials.
    """

    def __init__(self, model: TouchModel, places: Places, regrip_share: float) -> None:
        self._reach, self._size = places.size - 1, places.size
        axis = np.arange(-self._reach, self._reach + 1) * PITCH_M
        side = len(axis)
        directions = Directions.of(np.repeat(axis, side), np.tile(axis, side))
        variance, gain = model.variance(directions), directions.between(np.array(model.gain))
        # Torque of an upright tool, gains, headings, (2,) each; half the precision; logarithm of a variance.
        pairs = np.concatenate((model.upright_Nm(directions), gain, directions.unit), axis=1).T.copy()
        columns = np.stack((*pairs, 0.5 / variance, logarithm(variance)))
        self._tables = columns.reshape(-1, side, side).astype(SINGLE)
        # Written to now: memory that was never used is slow the first time, and that would be in a decision.
        self._found = self._tables[:, : places.size, : places.size].copy()
        self._ahead: tuple[int, int] | None = None
        leans = (
            (1.0 - regrip_share, model.offset_Nm, model.bias_Nm),
            (regrip_share, (0.0, 0.0), model.spread_Nm),
        )
        rows = []
        for share, (x, y), spread in leans:
            precision = 0.5 / (spread * spread)
            known = log(share) + log(2.0 * precision) - precision * (x * x + y * y)
            rows.append((known, precision, precision * x, precision * y))
        known, precision, *pull = np.array(rows, SINGLE).T[:, :, None, None]
        self.leans = known, precision, pull
        # Room to compute in, of pairs of values of all places: allocating anew is slow.
        self.work = tuple(np.zeros((6, 2, places.size, places.size), SINGLE))
        found = self._found
        self._parts = found[:2], found[2:4], found[4], found[5], found[6], found[7]

    def look_ahead(self, row: int, column: int) -> None:
        """Make ready for :meth:`at` of this cell."""
        self.at(row, column)
        self._ahead = row, column

    def at(self, row: int, column: int) -> tuple[Floats, ...]:
        """Of a touch at this cell, were the hole at each place, (size, size), to be worked in until the next call.

        Returns:
            Torque of an upright tool and gains, (2, size, size) each; cosine and sine of the heading; half the
            precision; logarithm of the variance of a component.
        """
        ahead, self._ahead = self._ahead, None
        if ahead != (row, column):
            # Displacements from this cell to all cells: to the first one it is -row, -column.
            a, b = self._reach - row, self._reach - column
            self._found[...] = self._tables[:, a : a + self._size, b : b + self._size]
        return self._parts


class PlaceBelief:
    """Evidence of one trial's torques for each place.

    The torque of the lean is integrated out: the touches are linear in it, and beforehand it is either about that of
    the last trials or anything, each normal. So the evidence has a closed form in six running sums.

    Args:
        log_prior: Logarithm of the belief at the trial's start, (size, size).
        kept: Share of the evidence that is left after one more touch.

    Attributes:
        passed: Logarithm of the belief at the trial's start, with what was passed over without a drop, (size, size);
            replaced and never changed.
    """

    def __init__(self, table: TouchTable, log_prior: Floats, kept: float) -> None:
        self.passed, self._kept, self._table = log_prior, kept, table
        # Over the touches, half of each: the precision with which they show the lean, xx, xy and yy, what an upright
        # tool leaves, squared, with the variances, and the lean times its precision, x and y. Zeros that are written,
        # for memory that was never used is slow the first time, and that would be in a decision.
        self._sums = np.full((6, *log_prior.shape), 0.0, SINGLE)
        self._aged = False

    def foresee(self, row: int, column: int) -> None:
        """Make ready for a touch at this cell; another one may come."""
        self._table.look_ahead(row, column)
        self._age()

    def _age(self) -> None:
        """Before a touch, once: those so far count less."""
        if not self._aged:
            self._sums *= self._kept
            self._aged = True

    def feel(self, row: int, column: int, torque_Nm: tuple[float, float], load: float) -> None:
        """Take in a touch at this cell, with the pressing force as a share of 4.9 N."""
        # In place and two at a time: a pass over the places costs more for its call than for its numbers.
        self._age()
        self._aged = False
        left, gains, c, s, precision, log_variance = self._table.at(row, column)
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

    def probabilities(self) -> Floats:
        """How likely the hole is at each place, (size, size)."""
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
