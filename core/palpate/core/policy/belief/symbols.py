"""The touch model in symbols: of each torque only the band of its two components, counted by displacement.

This is the paper's view of the torque (5.2: below, within or above a threshold each), with the displacement to the hole
in place of a hidden state: what is learned is how often each of the nine symbols was perceived how far and on which
side of the hole. How much a quarter turn of both, displacement and torque, has in common is a prior; what a trial of a
tool that leans shows otherwise outweighs it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from typing_extensions import override

from palpate.core.policy.belief.arithmetic import Floats, logarithm
from palpate.core.policy.belief.fit import LAGS, require_touches
from palpate.core.policy.belief.model import RINGS_M, SECTORS, Directions
from palpate.core.policy.belief.places import PITCH_M, PlaceBelief, Places
from palpate.core.policy.belief.touches import Examples, TouchedTrial

_SYMBOLS: Final = 9
_QUARTER: Final = SECTORS // 4
_TURNED: Final = [3 * (2 - symbol % 3) + symbol // 3 for symbol in range(_SYMBOLS)]
"""What each symbol becomes when the torque is turned by a quarter: (x, y) to (-y, x)."""
_OWN_COUNT: Final = 4.0
"""A cell is shrunk to what all four quarters show, as if so many touches had shown that."""
_RING_COUNT: Final = 2.0
"""What they show is shrunk to what its ring shows likewise."""
_LEAST_COUNT: Final = 0.5
"""Each symbol of a ring was perceived so often before anything was."""


def symbols_of(torque_Nm: Floats, threshold_Nm: float) -> np.ndarray:
    """Symbols, (n,): three times the band of x and the band of y, 0 below, 1 within, 2 above the threshold.

    Args:
        torque_Nm: Torque about the tip, (n, 2).
    """
    bands = 1 + (torque_Nm > threshold_Nm).astype(int) - (torque_Nm < -threshold_Nm).astype(int)
    symbols: np.ndarray = 3 * bands[:, 0] + bands[:, 1]
    return symbols


@dataclass(frozen=True, slots=True)
class SymbolModel:
    """What was learned of the symbols.

    Attributes:
        lag: Share of the last step by which the torque is behind the commanded tip.
        shares: How likely each symbol is at each ring and sector, (rings, sectors, symbols).
    """

    threshold_Nm: float
    lag: float
    shares: Floats


def fit_symbol_model(trials: Sequence[TouchedTrial], threshold_Nm: float) -> SymbolModel:
    """The symbols that these trials show, at the lag by which they are likeliest.

    Raises:
        ConfigurationError: They hold too few touches.
    """
    examples = Examples.of(trials)
    require_touches(len(examples.trial))
    symbols = symbols_of(examples.torque_Nm, threshold_Nm)
    fits = []
    for lag in LAGS:
        place = examples.to_hole_m + lag * examples.step_m
        at = Directions.of(place[:, 0], place[:, 1])
        shares = _shares(at, symbols)
        likely = float(logarithm(at.between_cells(shares)[np.arange(len(symbols)), symbols]).sum())
        fits.append((likely, SymbolModel(threshold_Nm, lag, shares)))
    return max(fits, key=lambda fit: fit[0])[1]


def _shares(at: Directions, symbols: np.ndarray) -> Floats:
    cells = (at.ring * SECTORS + at.sector) * _SYMBOLS + symbols
    size = len(RINGS_M) * SECTORS * _SYMBOLS
    counts = np.bincount(cells, 1.0 - at.share, size) + np.bincount(cells + SECTORS * _SYMBOLS, at.share, size)
    own: Floats = counts.astype(np.float64).reshape(len(RINGS_M), SECTORS, _SYMBOLS)
    quarter = own
    common = own.copy()
    for _ in range(3):
        quarter = np.roll(quarter, _QUARTER, axis=1)
        turned = np.empty_like(quarter)
        turned[:, :, _TURNED] = quarter
        quarter = turned
        common += quarter
    ring = common.sum(axis=1, keepdims=True) + _LEAST_COUNT
    ring /= ring.sum(axis=2, keepdims=True)
    shared = _shrunk(common, ring, _RING_COUNT)
    return _shrunk(own, shared, _OWN_COUNT)


def _shrunk(counts: Floats, to: Floats, weight: float) -> Floats:
    shares: Floats = (counts + weight * to) / (counts.sum(axis=2, keepdims=True) + weight)
    return shares


class SymbolTable:
    """A symbol model laid out over all displacements that there can be between two places, to be looked up fast.

    Args:
        places: Where the hole may be; the tip may be anywhere within them, too.
    """

    def __init__(self, model: SymbolModel, places: Places) -> None:
        self.threshold_Nm, self._reach, self._size = model.threshold_Nm, places.size - 1, places.size
        axis = np.arange(-self._reach, self._reach + 1) * PITCH_M
        side = len(axis)
        shares = Directions.of(np.repeat(axis, side), np.tile(axis, side)).between_cells(model.shares)
        self._evidence = logarithm(shares).T.reshape(_SYMBOLS, side, side).astype(places.dtype)

    def begin(self, log_prior: Floats, kept: float) -> SymbolBelief:
        """A trial's belief, of its prior alone, (size, size)."""
        return SymbolBelief(self, log_prior, kept)

    def at(self, row: int, column: int, symbol: int) -> Floats:
        """Logarithm of how likely a symbol is at this cell, were the hole at each place, (size, size)."""
        a, b = self._reach - row, self._reach - column
        evidence: Floats = self._evidence[symbol, a : a + self._size, b : b + self._size]
        return evidence


class SymbolBelief(PlaceBelief):
    """Evidence of one trial's symbols for each place."""

    def __init__(self, table: SymbolTable, log_prior: Floats, kept: float) -> None:
        super().__init__(log_prior, kept)
        self._table, self._sum = table, np.zeros_like(log_prior)

    @override
    def feel(self, row: int, column: int, torque_Nm: tuple[float, float], load: float) -> None:
        symbol = symbols_of(np.array([torque_Nm]), self._table.threshold_Nm).item()
        self._sum *= self._kept
        self._sum += self._table.at(row, column, symbol)

    @override
    def evidence(self) -> Floats:
        return self._sum
