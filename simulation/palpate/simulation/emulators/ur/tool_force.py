"""Force sensor in the tool flange. It adds noise to the true wrench according to the data sheet."""

from collections.abc import Callable
from typing import Final

import numpy as np

PRECISION: Final = (3.5, 0.2)
"""Spread of readings under a constant load, (force in N, torque in N m).

UR5e, technical specification, "Force sensing, tool flange": range 50 N, precision 3.5 N; range 10 N m, precision 0.2
N m. Quoted from memory, not checked against the data sheet.
"""


class ToolForce:
    """Source of noisy flange wrench readings, (6,).

    INFERENCE: precision is two standard deviations of white noise. A real flange has less noise between readings, and
    its readings drift with temperature.
    """

    def __init__(self, wrench: Callable[[int], tuple[float, ...]], seed: int = 0) -> None:
        self._wrench, self._rng = wrench, np.random.default_rng(seed)
        self._noise = np.repeat(np.array(PRECISION) / 2.0, 3)

    def __call__(self, now_ns: int) -> tuple[float, ...]:
        """Return a reading."""
        error = (self._noise * self._rng.standard_normal(6)).tolist()
        return tuple(value + e for value, e in zip(self._wrench(now_ns), error, strict=True))
