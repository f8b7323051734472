"""How an arm follows its set-points: one that smoothes them lags as a filter does, and not as a delay."""

from collections.abc import Sequence
from math import exp
from typing import Final, TypeAlias

import numpy as np
import numpy.typing as npt
from scipy.signal import lfilter

from palpate.adapters.replay.gap_cell import SETTLED, late
from palpate.adapters.replay.gap_numbers import lowest

Array: TypeAlias = npt.NDArray[np.float64]

_LAGS: Final = np.arange(0.0, 16.0, 0.5)
"""In control ticks."""
_DELAYS: Final = np.arange(0.0, 12.0, 0.5)
_CLEARLY: Final = 0.5
"""An arm lags where that leaves less than this share of the squares: 0.95 or more where nothing smoothes, 0.1 if so."""


def smoothed(trace: Array, ticks: float) -> Array:
    """A trace, (n, k), behind a first-order lag of so many control ticks; it begins at rest at its first row."""
    if ticks == 0.0:
        return trace
    share = 1.0 - exp(-1.0 / ticks)
    behind: Array = lfilter([share], [1.0, share - 1.0], trace - trace[0], axis=0) + trace[0]
    return behind


def lag_ticks(shown_rad: Sequence[Array], simulated_rad: Sequence[Array]) -> float:
    """Time constant with which encoders follow the simulated arm, beside any delay; 0 where a delay says as much.

    Args:
        shown_rad: What encoders showed in each trial, (ticks, n); NaN where nothing was valid.
        simulated_rad: The same of an arm that stands where it is commanded to be.
    """
    costs = []
    for lag in _LAGS.tolist():
        behind = [smoothed(q_rad, lag) for q_rad in simulated_rad]
        costs.append(min(_cost(shown_rad, behind, delay) for delay in _DELAYS.tolist()))
    return lowest(_LAGS, costs) if min(costs) < _CLEARLY * costs[0] else 0.0


def _cost(shown_rad: Sequence[Array], simulated_rad: Sequence[Array], delay: float) -> float:
    return sum(
        float(np.nansum((shown - late(q_rad, delay))[SETTLED.start :] ** 2))
        for shown, q_rad in zip(shown_rad, simulated_rad, strict=True)
    )
