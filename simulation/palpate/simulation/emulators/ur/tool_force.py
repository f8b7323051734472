"""The force sensor in the tool flange, as its data sheet has it: what it adds to the true wrench."""

from collections.abc import Callable
from dataclasses import dataclass
from math import exp, sqrt
from typing import Final

import numpy as np

_S_PER_NS: Final = 1e-9


@dataclass(frozen=True)
class ToolForceSheet:
    """What a data sheet says of the sensor, of a force and of a torque.

    Attributes:
        precision: How far readings of one load spread, (force in N, torque in N m).
        accuracy: How far they may be from the truth, (N, N m).
        drift_time_s: Time in which the error that is not noise changes. A choice: no sheet says it.
    """

    precision: tuple[float, float] = (3.5, 0.2)
    accuracy: tuple[float, float] = (4.0, 0.3)
    drift_time_s: float = 60.0


DATA_SHEET: Final = ToolForceSheet()
"""UR5e, technical specification, "Force sensing, tool flange": range 50 N, precision 3.5 N, accuracy 4.0 N; range
10 N m, precision 0.2 N m, accuracy 0.3 N m. Quoted from memory: the sheet itself was not at hand."""


class ToolForce:
    """A noisy, drifting reading of a wrench.

    INFERENCE: precision is two standard deviations of white noise, and what accuracy adds to it, in squares, two of a
    drift. A real flange is quieter from one reading to the next, and drifts with its temperature.

    Args:
        wrench: The true wrench on the flange at a time in ns, (6,).
    """

    def __init__(
        self, wrench: Callable[[int], tuple[float, ...]], seed: int = 0, sheet: ToolForceSheet = DATA_SHEET
    ) -> None:
        self._wrench, self._sheet, self._rng = wrench, sheet, np.random.default_rng(seed)
        self._noise = np.repeat(np.array(sheet.precision) / 2.0, 3)
        self._wander = np.repeat(
            [sqrt(a * a - p * p) / 2.0 for a, p in zip(sheet.accuracy, sheet.precision, strict=True)], 3
        )
        self._drift = self._wander * self._rng.standard_normal(6)
        self._time_ns = 0

    def __call__(self, now_ns: int) -> tuple[float, ...]:
        """A reading."""
        kept = exp(-max(0, now_ns - self._time_ns) * _S_PER_NS / self._sheet.drift_time_s)
        self._time_ns = now_ns
        fresh, noise = self._rng.standard_normal((2, 6))
        self._drift = kept * self._drift + sqrt(1.0 - kept * kept) * self._wander * fresh
        error = self._drift + self._noise * noise
        return tuple(float(value + e) for value, e in zip(self._wrench(now_ns), error, strict=True))
