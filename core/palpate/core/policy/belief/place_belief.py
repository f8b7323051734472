"""The belief over the hole's position, a grid with the evidence for each cell, and an estimate of the tilt."""

from __future__ import annotations

from math import log
from typing import Final

import numpy as np

from palpate.core.policy.belief.arithmetic import Floats, exponential, logarithm
from palpate.core.policy.belief.model import ContactModel, Directions
from palpate.core.policy.belief.places import PITCH_M, SINGLE, Places

MISSED: Final = ((0.5, log(0.45)), (1.0, log(0.55)), (1.5, log(0.6)))
"""Weights for cells passed without a drop, by distance from the path in capture widths; lower for nearer cells. In
`blind-noise` 0.15, 0.27 and 0.6 of the holes within these widths were missed."""


class ContactTable:
    """A contact model tabulated over all displacements between two cells, for fast lookup.

    Args:
        places: Grid of possible hole positions, which also contains the tip.
        regrip_share: Probability that the tilt differs from that in the last trials.
    """

    def __init__(self, model: ContactModel, places: Places, regrip_share: float) -> None:
        self._reach, self._size = places.size - 1, places.size
        axis = np.arange(-self._reach, self._reach + 1) * PITCH_M
        side = len(axis)
        directions = Directions.of(np.repeat(axis, side), np.tile(axis, side))
        variance, gain = model.variance(directions), directions.between(np.array(model.gain))
        # Torque of an upright tool, gains, headings, (2,) each; half the precision; logarithm of a variance.
        pairs = np.concatenate((model.upright_Nm(directions), gain, directions.unit), axis=1).T.copy()
        columns = np.stack((*pairs, 0.5 / variance, logarithm(variance)))
        self._tables = columns.reshape(-1, side, side).astype(SINGLE)
        tilts = (
            (1.0 - regrip_share, model.offset_Nm, model.bias_Nm),
            (regrip_share, (0.0, 0.0), model.spread_Nm),
        )
        rows = []
        for share, (x, y), spread in tilts:
            precision = 0.5 / (spread * spread)
            known = log(share) + log(2.0 * precision) - precision * (x * x + y * y)
            rows.append((known, precision, precision * x, precision * y))
        known, precision, *pull = np.array(rows, SINGLE).T[:, :, None, None]
        self.tilts = known, precision, pull

    def at(self, row: int, column: int) -> tuple[Floats, ...]:
        """Look up a contact at one cell for a hole at each cell, (size, size).

        Returns:
            Torque on an upright tool and gains, (2, size, size) each; cosine and sine of the heading; half the
            precision; logarithm of a component's variance.
        """
        # Displacements from this cell to all cells; the first one is -row, -column.
        a, b = self._reach - row, self._reach - column
        found = self._tables[:, a : a + self._size, b : b + self._size]
        return found[:2], found[2:4], found[4], found[5], found[6], found[7]


class PlaceBelief:
    """Evidence for each position from one trial's torques.

    The torque caused by the tilt is integrated out: contacts are linear in it, and its prior is a mixture of two normal
    distributions, one for the tilt in recent trials and one for any tilt. Six running sums thus give the evidence.

    Args:
        log_prior: Logarithm of the belief at the start of the trial, (size, size).
        forgetting_factor: Forgetting factor for the evidence per contact.

    Attributes:
        passed: Logarithm of the initial belief, reduced where the peg passed without a drop, (size, size); replaced,
            never modified.
    """

    def __init__(self, table: ContactTable, log_prior: Floats, forgetting_factor: float) -> None:
        self.passed, self._forgetting_factor, self._table = log_prior, forgetting_factor, table
        # Half-sums over the contacts: precision of the tilt, xx, xy and yy; squared residual of an upright tool with
        # the log variances; tilt times its precision, x and y.
        self._sums = np.zeros((6, *log_prior.shape), SINGLE)

    def feel(self, row: int, column: int, torque_Nm: tuple[float, float], load: float) -> None:
        """Add a contact at a cell, given the pressing force divided by 4.9 N."""
        upright, gains, c, s, precision, log_variance = self._table.at(row, column)
        x, y = (felt_Nm - load * expected for felt_Nm, expected in zip(torque_Nm, upright, strict=True))
        gains = load * gains + 1.0
        weighted = precision * gains
        # Residual along and across the heading, and the precisions of the tilt there.
        along, across = (x * c + y * s) * weighted[0], (y * c - x * s) * weighted[1]
        a, b = gains * weighted
        in_x = (a - b) * c
        xx = in_x * c
        self._sums *= self._forgetting_factor
        self._sums[0] += xx + b
        self._sums[1] += in_x * s
        self._sums[2] += a - xx
        self._sums[3] += (x * x + y * y) * precision + log_variance
        self._sums[4] += along * c - across * s
        self._sums[5] += along * s + across * c

    def probabilities(self) -> Floats:
        """Return the probability of each position, (size, size)."""
        xx, xy, yy, square, x, y = self._sums
        known, precision, pull = self._table.tilts
        # For each tilt prior, the likelihood of a position is exp(exponent) times a width.
        a, b, u, v = xx + precision, yy + precision, x + pull[0], y + pull[1]
        det = a * b - xy * xy
        exponent = known + (u * u * b - u * v * (xy + xy) + v * v * a) / det
        width = 0.5 / np.sqrt(det)
        # The first prior exceeds the second by at most the ratio of the priors, about e to the 30.
        likely = exponential(exponent[0] - exponent[1]) * width[0] + width[1]
        rest = exponent[1] - square + self.passed
        belief: Floats = exponential(rest - rest.max()) * likely
        belief /= belief.sum()
        return belief
