"""The force sensor in the tool flange, as its data sheet has it: what it adds to the true wrench."""

from collections.abc import Callable
from math import exp, sqrt
from typing import Final

import numpy as np

_S_PER_NS: Final = 1e-9


PRECISION: Final = (3.5, 0.2)
"""How far readings of one load spread, (force in N, torque in N m).

UR5e, technical specification, "Force sensing, tool flange": range 50 N, precision 3.5 N, accuracy 4.0 N; range
10 N m, precision 0.2 N m, accuracy 0.3 N m. Quoted from memory: the sheet itself was not at hand.
"""
_ACCURACY: Final = (4.0, 0.3)
"""How far they may be from the truth, (N, N m)."""
_DRIFT_TIME_S: Final = 60.0
"""Time in which the error that is not noise changes. A choice: no sheet says it."""


class ToolForce:
    """A noisy, drifting reading of a wrench.

    INFERENCE: precision is two standard deviations of white noise, and what accuracy adds to it, in squares, two of a
    drift. A real flange is quieter from one reading to the next, and drifts with its temperature.

    Args:
        wrench: The true wrench on the flange at a time in ns, (6,).
    """

    def __init__(self, wrench: Callable[[int], tuple[float, ...]], seed: int = 0) -> None:
        self._wrench, self._rng = wrench, np.random.default_rng(seed)
        self._noise = np.repeat(np.array(PRECISION) / 2.0, 3)
        self._wander = np.repeat([sqrt(a * a - p * p) / 2.0 for a, p in zip(_ACCURACY, PRECISION, strict=True)], 3)
        self._drift = self._wander * self._rng.standard_normal(6)
        self._time_ns = 0

    def __call__(self, now_ns: int) -> tuple[float, ...]:
        """A reading."""
        kept = exp(-max(0, now_ns - self._time_ns) * _S_PER_NS / _DRIFT_TIME_S)
        self._time_ns = now_ns
        fresh, noise = self._rng.standard_normal((2, 6))
        self._drift = kept * self._drift + sqrt(1.0 - kept * kept) * self._wander * fresh
        error = self._drift + self._noise * noise
        return tuple(float(value + e) for value, e in zip(self._wrench(now_ns), error, strict=True))
