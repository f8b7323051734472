"""The belief over where the hole is: a grid of places, each with the logarithm of its evidence."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from math import ceil, floor, log
from typing import Any, Final

import numpy as np
from typing_extensions import override

from palpate.core.policy.belief.arithmetic import Floats, exponential, logarithm
from palpate.core.policy.belief.model import Directions, TouchModel

PITCH_M: Final = 1e-4
"""Distance between places."""
ALIKE: Final = ((1.0, log(0.3)),)
"""Of what lies within so many capture widths of the way, weight after it was passed over without a drop: it may still
be the hole, by chance or tilt."""
GRADED: Final = ((0.5, log(0.45)), (1.0, log(0.55)), (1.5, log(0.6)))
"""The same, the less the further off: of holes in `blind-noise` within these widths 0.15, 0.27 and 0.6 were missed."""


def off_way_m2(x_m: Floats, y_m: Floats, dx_m: float, dy_m: float) -> Floats:
    """Squared distances of these points from the straight way from the origin to (dx, dy)."""
    length = dx_m * dx_m + dy_m * dy_m
    along = np.clip((x_m * dx_m + y_m * dy_m) / length, 0.0, 1.0) if length > 0.0 else np.zeros_like(x_m)
    off_x, off_y = x_m - along * dx_m, y_m - along * dy_m
    squared: Floats = off_x * off_x + off_y * off_y
    return squared


class Places:
    """The upright square of places, centred at the nominal goal.

    Args:
        single: Whether what is told of each place is kept in single precision.

    Attributes:
        axis_m: Their coordinates, in x as in y, (size,).
        dtype: Numbers that are kept of each place.
    """

    def __init__(self, half_width_m: float, *, single: bool) -> None:
        self.dtype: np.dtype[Any] = np.dtype(np.float32 if single else np.float64)
        half = ceil(half_width_m / PITCH_M)
        self.size = 2 * half + 1
        self.axis_m: Floats = np.arange(-half, half + 1, dtype=np.float64) * PITCH_M
        self._half = half

    def cell(self, x_m: float, y_m: float) -> tuple[int, int]:
        """Row and column, x and y, of the nearest place; those beyond the edge have cells beyond it, too."""
        return round(x_m / PITCH_M) + self._half, round(y_m / PITCH_M) + self._half

    def likeliest_m(self, belief: Floats) -> tuple[float, float]:
        """The place of the greatest belief, (x, y)."""
        row, column = divmod(int(np.argmax(belief)), self.size)
        return float(self.axis_m[row]), float(self.axis_m[column])

    def mean_m(self, belief: Floats) -> tuple[float, float]:
        """The mean place, (x, y)."""
        along_x, along_y = np.add.reduce(belief, axis=1), np.add.reduce(belief, axis=0)
        return float(np.add.reduce(along_x * self.axis_m)), float(np.add.reduce(along_y * self.axis_m))

    def near_way(
        self, from_m: tuple[float, float], way_m: tuple[float, float], within_m: float
    ) -> tuple[tuple[slice, slice], Floats]:
        """The places that may be within a distance of a straight way: an upright box, and their squared distances."""
        x, y = (self._span(start, start + way, within_m) for start, way in zip(from_m, way_m, strict=True))
        return (x, y), off_way_m2(self.axis_m[x, None] - from_m[0], self.axis_m[None, y] - from_m[1], *way_m)

    def _span(self, start_m: float, end_m: float, within_m: float) -> slice:
        first, last = (min(start_m, end_m) - within_m) / PITCH_M, (max(start_m, end_m) + within_m) / PITCH_M
        return slice(max(floor(first) + self._half, 0), max(ceil(last) + self._half + 1, 0))


class TouchTable:
    """A touch model laid out over all displacements that there can be between two places, to be looked up fast.

    Args:
        places: Where the hole may be; the tip may be anywhere within them, too.

    Attributes:
        offset_Nm: Torque that every touch has, (2,).
    """

    def __init__(self, model: TouchModel, places: Places) -> None:
        self._reach, self._size = places.size - 1, places.size
        axis = np.arange(-self._reach, self._reach + 1) * PITCH_M
        side = len(axis)
        directions = Directions.of(np.repeat(axis, side), np.tile(axis, side))
        self._tables = np.stack(self._columns(model, directions)).reshape(-1, side, side).astype(places.dtype)
        # Written to now: memory that was never used is slow the first time, and that would be in a decision.
        self._found = self._tables[:, : places.size, : places.size].copy()
        self._ahead: tuple[int, int] | None = None
        self.offset_Nm = model.offset_Nm
        self.bias_precision = 1.0 / (model.bias_Nm * model.bias_Nm)

    def _columns(self, model: TouchModel, directions: Directions) -> Sequence[Floats]:
        """What :meth:`at` gives, for each displacement."""
        expected, variance = model.expected_Nm(directions), model.variance(directions)
        precision = 1.0 / variance
        square = expected[:, 0] * expected[:, 0] + expected[:, 1] * expected[:, 1]
        of_expected = (precision * expected[:, 0], precision * expected[:, 1], precision * square)
        return precision, *of_expected, 2.0 * logarithm(variance)

    def begin(self, log_prior: Floats, kept: float) -> PlaceBelief:
        """A trial's belief, of its prior alone, (size, size)."""
        return TorqueBelief(self, log_prior, kept)

    def look_ahead(self, row: int, column: int) -> None:
        """Make ready for :meth:`at` of this cell."""
        self.at(row, column)
        self._ahead = row, column

    def at(self, row: int, column: int) -> Floats:
        """Of a touch at this cell, were the hole at each place, (5, size, size), to be worked in until the next call.

        Returns:
            Precision; precision times torque to be expected, x and y; precision times its square; logarithm of the
            variances of both components.
        """
        ahead, self._ahead = self._ahead, None
        if ahead != (row, column):
            # Displacements from this cell to all cells: to the first one it is -row, -column.
            a, b = self._reach - row, self._reach - column
            self._found[...] = self._tables[:, a : a + self._size, b : b + self._size]
        return self._found


class PlaceBelief:
    """Evidence of one trial for each place.

    Args:
        log_prior: Logarithm of the belief at the trial's start, (size, size).
        kept: Share of the evidence that is left after one more touch.

    Attributes:
        passed: Logarithm of the belief at the trial's start, with what was passed over without a drop, (size, size);
            replaced and never changed.
    """

    def __init__(self, log_prior: Floats, kept: float) -> None:
        self.passed, self._kept = log_prior, kept

    def foresee(self, row: int, column: int) -> None:
        """Make ready for a touch at this cell; another one may come."""
        return

    @abstractmethod
    def feel(self, row: int, column: int, torque_Nm: tuple[float, float], load: float) -> None:
        """A touch, at this cell, with the pressing force as a share of 4.9 N."""

    @abstractmethod
    def evidence(self) -> Floats:
        """Logarithm of how well each place explains the touches, (size, size); only differences count."""

    def probabilities(self) -> Floats:
        """How likely the hole is at each place, (size, size)."""
        evidence = self.evidence() + self.passed
        evidence -= evidence.max()
        belief = exponential(evidence)
        belief /= belief.sum()
        return belief


class TorqueBelief(PlaceBelief):
    """Evidence of one trial's torques for each place.

    The bias of the trial, a torque that stays the same while it lasts, is integrated out: it is normal with the spread
    that the model gives it, so the evidence has a closed form in a few running sums.

    Args:
        log_prior: Logarithm of the belief at the trial's start, (size, size).
        kept: Share of the evidence that is left after one more touch.
    """

    def __init__(self, table: TouchTable, log_prior: Floats, kept: float) -> None:
        super().__init__(log_prior, kept)
        self._table = table
        # Over the touches: precisions, left torque times precision in x and y, and its square with the variances.
        self._sums = [np.zeros_like(log_prior) for _ in range(4)]

    @override
    def foresee(self, row: int, column: int) -> None:
        self._table.look_ahead(row, column)

    @override
    def feel(self, row: int, column: int, torque_Nm: tuple[float, float], load: float) -> None:
        x, y = (felt - offset for felt, offset in zip(torque_Nm, self._table.offset_Nm, strict=True))
        precision, expected_x, expected_y, square, log_variance = self._table.at(row, column)
        product = (2.0 * load * x) * expected_x + (2.0 * load * y) * expected_y
        news = (
            precision,
            x * precision - load * expected_x,
            y * precision - load * expected_y,
            (x * x + y * y) * precision - product + (load * load) * square + log_variance,
        )
        for total, new in zip(self._sums, news, strict=True):
            total *= self._kept
            total += new

    @override
    def evidence(self) -> Floats:
        precision, x, y, square = self._sums
        weight = precision + self._table.bias_precision
        fit: Floats = square - (x * x + y * y) / weight + 2.0 * logarithm(weight)
        return -0.5 * fit
