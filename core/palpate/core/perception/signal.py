"""The task's measurement vector, and the taring, scaling and filtering of the wrench (paper, 3.1, 5.1).

The feature extractors receive this vector once per decision:

========  =====  ==========================================================================
channel   unit   meaning
========  =====  ==========================================================================
x, y, z   m      position of the tool tip relative to the nominal goal
fx fy fz  N      force that the environment exerts on the tool, filtered
tx ty tz  N m    torque of the same wrench about the tool tip, filtered
========  =====  ==========================================================================

All values are in the task frame: right-handed, with its origin at the nominal goal.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from math import isfinite, pi, sqrt, tan
from typing import Annotated, ClassVar, Final, TypeAlias

import numpy as np
import numpy.typing as npt
from typing_extensions import override

from palpate.core.errors import CommandError, ConfigurationError, LifecycleError
from palpate.core.ports import Holds, Range, Settings, fitted

Array: TypeAlias = npt.NDArray[np.float64]

MOST_SEED: Final = 2**32 - 1
"""Maximum seed accepted by the libraries that fit features and symbols."""
_CONSTANT = 1e-12
"""Standard deviation, divided by the largest value, below which a channel contains only rounding errors."""


@dataclass(frozen=True)
class Normalisation(Settings):
    """An offset and a gain per channel: ``(value - offset) * gain``.

    Attributes:
        offset: Offset subtracted first, (n,), in the channels' units.
        gain: Gain applied afterwards, (n,), not zero, in inverse units of the channels.

    Raises:
        ConfigurationError: A value is not finite, the lengths differ, or a gain is zero.
    """

    TABLE: ClassVar[str] = "perception.normalisation"

    offset: Annotated[tuple[float, ...], Holds(bool, "at least one finite number")]
    gain: Annotated[tuple[float, ...], Holds(all, "numbers other than zero")]

    @override
    def check(self) -> None:
        count = len(self.offset)
        self.require("gain", len(self.gain) == count, f"a list of {count} finite numbers")

    @cached_property
    def _offset(self) -> Array:
        return np.array(self.offset)

    @cached_property
    def _gain(self) -> Array:
        return np.array(self.gain)

    @classmethod
    def fit(cls, values: Iterable[Sequence[float]] | Array) -> Normalisation:
        """Fit a normalisation that gives samples, (m, n), mean 0 and variance 1; the gain of a constant channel is 1.

        Raises:
            ConfigurationError: There are fewer than two samples, or a value is not finite.
        """
        table = samples(values)
        deviation = table.std(axis=0)
        constant = deviation <= _CONSTANT * np.abs(table).max(axis=0)
        gain = 1.0 / np.where(constant, 1.0, deviation)
        return cls(tuple(table.mean(axis=0).tolist()), tuple(gain.tolist()))

    def apply(self, values: Sequence[float] | Array) -> Array:
        """Normalise one vector, (n,), or one vector per row, (m, n)."""
        scaled: Array = (np.asarray(values) - self._offset) * self._gain
        return scaled


Wrench: TypeAlias = tuple[float, float, float, float, float, float]
"""A wrench: fx, fy, fz in N and tx, ty, tz in N m."""

_SIX = 6


@dataclass(eq=False)
class SignalProcessor(Settings):
    """Signal processor that tares, scales and low-pass filters a wrench, sample by sample.

    It computes ``(raw - tare) * scale``, applies the normalisation if there is one, then a Butterworth low-pass filter.
    The filter is the bilinear transform of the analogue one, pre-warped at the cut-off, as in ``scipy.signal.butter``.
    It is implemented as trapezoidal integrators whose contents are the state. In this form, a constant
    input stays bit-identical despite rounded coefficients, and low cut-off frequencies lose no precision. For six
    channels, plain floats are faster than numpy, and avoid BLAS kernels whose rounding depends on the processor.

    Attributes:
        cutoff_Hz: Frequency at which the gain is -3 dB; below half the rate.
        order: 1 or 2.
        scale: Factor for each channel, (6,), not zero.
        normalisation: Normalisation applied to the six channels after scaling; None disables it.

    Raises:
        ConfigurationError: A setting is invalid.
    """

    TABLE: ClassVar[str] = "perception"

    rate_Hz: Annotated[float, Range(0.0, above=True)]
    cutoff_Hz: float
    order: Annotated[int, Range(1, 2)] = 2
    scale: Annotated[Wrench, Holds(all, "six numbers other than zero")] = (1.0, 1.0, 1.0, 1.0, 1.0, 1.0)
    normalisation: Normalisation | None = None

    @override
    def check(self) -> None:
        accepted = f"a number above 0 and below half the rate, {self.rate_Hz / 2:g}"
        self.require("cutoff_Hz", 0.0 < self.cutoff_Hz < self.rate_Hz / 2, accepted)
        fits = self.normalisation is None or len(self.normalisation.gain) == _SIX
        self.require("normalisation", fits, "a normalisation of six channels")
        self._tare: tuple[float, ...] = (0.0,) * _SIX
        self._memory: tuple[float, ...] = ()
        self._gain: tuple[float, ...] = self.scale
        if self.normalisation is not None:
            self._gain = tuple(s * g for s, g in zip(self.scale, self.normalisation.gain, strict=True))
        self._bias = self._bias_with(self._tare)
        g = tan(pi * self.cutoff_Hz / self.rate_Hz)
        a = 1.0 / (1.0 + g * (g + sqrt(2.0)))
        self._coefficients = (a, a * g, g) if self.order == 2 else (0.0, g / (1.0 + g), 1.0)

    def tare(self, bias: Sequence[float]) -> None:
        """Zero the sensor at ``bias``, a raw reading, (6,); this never happens automatically.

        The filter state still refers to the old zero; call :meth:`reset` next.

        Raises:
            ConfigurationError: ``bias`` is not six finite numbers.
        """
        self._tare = fitted("perception.tare", tuple(bias), Wrench)
        self._bias = self._bias_with(self._tare)

    def reset(self, raw: Sequence[float]) -> None:
        """Start without a transient, as if the input had always been this raw reading, (6,).

        Raises:
            CommandError: ``raw`` is not six finite numbers.
        """
        if len(raw) != _SIX or not isfinite(sum(raw)):
            raise CommandError("a wrench must be six finite numbers", tuple(raw))
        self._memory = (0.0,) * (_SIX * (self.order - 1)) + self._conditioned(raw)

    def update(self, raw: Wrench) -> Wrench:
        """Filter the next raw sample, (6,).

        Raises:
            CommandError: A value is not finite; the filter is unchanged.
            LifecycleError: The filter was never reset.
        """
        return self.filtered(self._conditioned(raw))

    def filtered(self, live: Wrench) -> Wrench:
        """Filter the next sample, (6,), which the caller has tared, scaled and normalised.

        Raises:
            CommandError: A value is not finite; the filter is unchanged.
            LifecycleError: The filter was never reset.
        """
        if not self._memory:
            raise LifecycleError("signal processor", "without a past", "update()", "call reset() with a reading first")
        a, b, g = self._coefficients
        slopes, levels = self._memory[:-_SIX] or (0.0,) * _SIX, self._memory[-_SIX:]
        outputs, slopes_after, levels_after = [], [], []
        for x, slope, level in zip(live, slopes, levels, strict=True):
            rate = a * slope + b * (x - level)
            output = level + g * rate
            outputs.append(output)
            slopes_after.append(rate + rate - slope)
            levels_after.append(output + g * rate)
        y0, y1, y2, y3, y4, y5 = outputs
        if not isfinite(y0 + y1 + y2 + y3 + y4 + y5):
            raise CommandError("a wrench must be finite", live)
        self._memory = (*slopes_after, *levels_after) if self.order == 2 else tuple(levels_after)
        return y0, y1, y2, y3, y4, y5

    def get_state(self) -> list[float]:
        """Return the tare, (6,), and the filter state, which is empty before the first reset."""
        return [*self._tare, *self._memory]

    def _conditioned(self, raw: Sequence[float]) -> Wrench:
        f, g, h, t, u, v = ((x - o) * k for x, o, k in zip(raw, self._bias, self._gain, strict=True))
        return f, g, h, t, u, v

    def _bias_with(self, tare: tuple[float, ...]) -> tuple[float, ...]:
        """Combine the tare and the normalisation offset into one raw reading."""
        if self.normalisation is None:
            return tare
        return tuple(t + o / s for t, o, s in zip(tare, self.normalisation.offset, self.scale, strict=True))


def samples(value: Iterable[Sequence[float]] | Array, columns: int | None = None) -> Array:
    """Convert two or more finite samples to an array, (n, columns); any width is accepted if ``columns`` is None."""
    field = "perception.samples"
    accepted = f"two or more rows of {'equally many' if columns is None else columns} finite numbers"
    try:
        table = np.array(value if isinstance(value, np.ndarray) else list(value), dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise ConfigurationError(field, value, accepted) from error
    if table.ndim != 2 or len(table) < 2 or table.shape[1] != (columns or max(1, table.shape[1])):
        raise ConfigurationError(field, f"shape {table.shape}", accepted)
    if not np.isfinite(table).all():
        raise ConfigurationError(field, "a value that is not finite", accepted)
    return table


def require_finite(what: str, values: Sequence[float]) -> None:
    """Reject a measurement that is not finite."""
    if not isfinite(sum(values)):
        raise CommandError(f"{what} must be finite", values)
