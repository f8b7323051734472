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

    def at(self, row: int, column: int) -> tuple[Floats, ...]:
        """Of a touch at this cell, were the hole at each place, (size, size).

        Returns:
            Torque of an upright tool and gains, (2, size, size) each; cosine and sine of the heading; half the
            precision; logarithm of the variance of a component.
        """
        # Displacements from this cell to all cells: to the first one it is -row, -column.
        a, b = self._reach - row, self._reach - column
        found = self._tables[:, a : a + self._size, b : b + self._size]
        return found[:2], found[2:4], found[4], found[5], found[6], found[7]


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
        # tool leaves, squared, with the variances, and the lean times its precision, x and y.
        self._sums = np.zeros((6, *log_prior.shape), SINGLE)

    def feel(self, row: int, column: int, torque_Nm: tuple[float, float], load: float) -> None:
        """Take in a touch at this cell, with the pressing force as a share of 4.9 N."""
        upright, gains, c, s, precision, log_variance = self._table.at(row, column)
        x, y = (felt_Nm - load * expected for felt_Nm, expected in zip(torque_Nm, upright, strict=True))
        gains = load * gains + 1.0
        weighted = precision * gains
        # What is left along and across the heading, and the precisions of the lean there.
        along, across = (x * c + y * s) * weighted[0], (y * c - x * s) * weighted[1]
        a, b = gains * weighted
        in_x = (a - b) * c
        xx = in_x * c
        self._sums *= self._kept
        self._sums[0] += xx + b
        self._sums[1] += in_x * s
        self._sums[2] += a - xx
        self._sums[3] += (x * x + y * y) * precision + log_variance
        self._sums[4] += along * c - across * s
        self._sums[5] += along * s + across * c

    def probabilities(self) -> Floats:
        """How likely the hole is at each place, (size, size)."""
        xx, xy, yy, square, x, y = self._sums
        known, precision, pull = self._table.leans
        # By each lean a place is as likely as e to the exponent times a width.
        a, b, u, v = xx + precision, yy + precision, x + pull[0], y + pull[1]
        det = a * b - xy * xy
        exponent = known + (u * u * b - u * v * (xy + xy) + v * v * a) / det
        width = 0.5 / np.sqrt(det)
        # By the first lean a place is likelier than by the second by what it is beforehand at most, some e to the 30.
        likely = exponential(exponent[0] - exponent[1]) * width[0] + width[1]
        rest = exponent[1] - square + self.passed
        belief: Floats = exponential(rest - rest.max()) * likely
        belief /= belief.sum()
        return belief
