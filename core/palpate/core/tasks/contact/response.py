"""Regress the measured force on the flange motion to check the gripper spring's response."""

from __future__ import annotations

from collections import deque
from math import fsum, inf, sqrt
from typing import Final

import numpy as np
from numpy.typing import NDArray

from palpate.core.job import ATTENUATED, DEVIATIONS_95, FAIR, HALF_PERIOD_TICKS, MOST_SAMPLES, NARROW, Spring
from palpate.core.ports import CONTROL_RATE_HZ, PERIOD_S

TIMEOUT_TICKS: Final = CONTROL_RATE_HZ
"""Number of stationary ticks within which the force must respond: more than two of a moving tool's longest windows."""
_OUTLIER: Final = 1.5
"""Standard deviations above which a residual has less weight (Huber's constant), because of stick-slip."""
_NORMAL: Final = 1.48
"""Standard deviation divided by median deviation, for a normal distribution."""
_LAGS: Final = 5
"""Maximum force lag behind its timestamp, in ticks."""
_DECIDED: Final = 7e-3
"""Relative likelihood, exp(-5), below which a lag is excluded."""
_EVERY: Final = 2
"""Number of new samples between fits of a sliding window; 2 halves the time per tick."""
_EVERY_VERIFIED: Final = 4
"""The same after a verification, which is usually followed by another."""
_LEAST: Final = 1e-9
"""Lower bound used in place of zero, in N or N^2."""
_NS: Final = 1e-9

Array = NDArray[np.float64]


class Response:
    """Least-squares fit of force = -share * (k * (z + damping_s * v) + rigid_kg * a) + constant, in a sliding window.

    z, v and a are the encoders' position and its derivatives at the time of the force sample.

    Args:
        longest: Maximum number of samples in the window for a stationary tool.

    Attributes:
        share: Measured stiffness divided by the gripper's in the latest window; None if there is none.
        half_width: Half-width of the confidence interval for ``share``.
        verified: True if the latest window shows the expected stiffness, with an interval that is narrow enough.
        contradicted: True if the latest window's interval contains no expected stiffness.
        lag: Number of ticks by which the force is older than its timestamp; None until the responses determine it.
        window: Number of samples in a window.
        stationary_ticks: Number of ticks since the tool began to wait. The window grows with it, because a sliding
            window would eventually be verified by chance.
    """

    def __init__(self, spring: Spring, longest: int = MOST_SAMPLES) -> None:
        self.spring, self._longest = spring, longest
        self.begin(0.0, 0.0, 1.0)

    def begin(self, noise_N: float, step_m: float, dither_N: float, lag: int | None = None) -> None:
        """Reset the state for a new trial or direction.

        Args:
            step_m: Standard deviation of an encoder position.
            dither_N: Force amplitude caused by the dither.
        """
        spring, self.lag = self.spring, lag
        self._noise_N = spring.noise_N(noise_N, step_m)
        # Position errors attenuate the regression.
        self._blur_N2 = spring.blur_N(step_m) ** 2
        self.window = min(spring.samples(self._noise_N, dither_N), MOST_SAMPLES)
        self._likely = np.ones(_LAGS)
        self._places: deque[tuple[float, float]] = deque(maxlen=3 * _LAGS)
        self._forces: deque[tuple[float, float]] = deque(maxlen=3 * _LAGS)
        # Measured force, and expected force at each lag.
        self._rows: Array = np.zeros((1 + _LAGS, 2 * TIMEOUT_TICKS))
        self.restart()

    def restart(self) -> None:
        """Discard the samples so far."""
        self._first = self._end = self.stationary_ticks = 0
        self.share: float | None = None
        self.half_width, self.verified, self.contradicted = inf, False, False

    def add_place(self, time_ns: int, place_m: float) -> None:
        """Add a position from the encoders; a repeated one is ignored."""
        if not self._places or time_ns * _NS > self._places[-1][0]:
            self._places.append((time_ns * _NS, place_m))

    def add_force(self, time_ns: int, force_N: float) -> None:
        """Add a new force sample and update the latest window."""
        self._forces.append((time_ns * _NS, force_N))
        # A later position makes the velocity a central difference.
        while self._forces and len(self._places) >= 3 and self._places[-1][0] > self._forces[0][0] + 0.5 * PERIOD_S:
            time_s, old_N = self._forces.popleft()
            rows, end = self._rows, self._end
            if end == rows.shape[1]:
                rows[:, :TIMEOUT_TICKS] = rows[:, -TIMEOUT_TICKS:].copy()
                self._first, end = max(self._first + TIMEOUT_TICKS - end, 0), TIMEOUT_TICKS
            rows[0, end] = old_N
            for each in range(_LAGS) if self.lag is None else (self.lag,):
                rows[1 + each, end] = self._expected_N(time_s - each * PERIOD_S)
            self._end = end + 1
        every = _EVERY_VERIFIED if self.verified else _EVERY
        if self._end - self._first >= self.window and (self.share is None or self._end % every == 0):
            self._fit_last(self.window)
        self.widen(self.stationary_ticks)

    @property
    def swing_m(self) -> float:
        """Return the amplitude of the latest positions, half their range over three dither half-periods."""
        places_m = [place_m for _, place_m in self._places]
        return 0.5 * (max(places_m) - min(places_m)) if places_m else 0.0

    def widen(self, samples: int) -> None:
        """Fit the latest n samples if they exceed a window; the tool must be stationary."""
        samples = min(samples, self._end - self._first, self._longest)
        if samples > self.window:
            self._fit_last(samples)

    def verified_since_restart(self) -> bool:
        """Return True if all samples since the restart verify the response narrowly, with a stationary tool."""
        if self._end - self._first < self.window:
            return False
        self._fit_last(min(self._end - self._first, self._longest))
        return self.verified and self.half_width < NARROW * (self.share or 0.0)

    def text(self) -> str:
        """Return the measured stiffness, its interval and the expected range."""
        own = 1e-3 * self.spring.stiffness_N_per_m
        share = "not measured" if self.share is None else f"{self.share * own:.2f} +- {self.half_width * own:.2f} N/mm"
        return f"{share}, expected {self.spring.lowest * own:.2f} to {self.spring.highest * own:.2f} N/mm"

    def _expected_N(self, time_s: float) -> float:
        """Return the force from spring, damper and mass, from a parabola through the three nearest positions."""
        places = self._places
        middle = len(places) - 2
        while middle > 1 and places[middle][0] > time_s + 0.5 * PERIOD_S:
            middle -= 1
        (t0, x0), (t1, x1), (t2, x2) = places[middle - 1], places[middle], places[middle + 1]
        slope = (x2 - x1) / (t2 - t1)
        bend = (slope - (x1 - x0) / (t1 - t0)) / (t2 - t0)
        place = x1 + (time_s - t1) * (slope + bend * (time_s - t2))
        velocity = slope + bend * (2.0 * time_s - t1 - t2)
        spring = self.spring
        return -spring.stiffness_N_per_m * (place + spring.damping_s * velocity) - spring.rigid_kg * 2.0 * bend

    def _fit_last(self, count: int) -> None:
        rows = self._rows[:, self._end - count : self._end]
        lags = range(_LAGS) if self.lag is None else (self.lag,)
        fits = [self._fitted(rows[: 2 + each : 1 + each]) for each in lags]
        certainties = [share / half_width for share, half_width in fits]
        self.share, self.half_width = share, width = fits[certainties.index(max(certainties))]
        lowest, highest = self.spring.lowest, self.spring.highest
        self.verified = lowest <= share <= highest and width < FAIR * share
        self.contradicted = share - width > highest or share + width < lowest
        if self.lag is None and self.verified:
            likely = self._likely * np.maximum(certainties, 1.0) ** 2
            self._likely = likely = likely / likely.max()
            if (likely > _DECIDED).sum() == 1:
                self.lag = int(likely.argmax())

    def _fitted(self, series: Array) -> tuple[float, float]:
        """Return share and half-width for measured and expected forces, (2, n); outliers are given less weight."""
        total, count = np.add.reduce, series.shape[1]
        y, x = series = series - total(series, axis=1, keepdims=True) / count
        product, square = total(series * x, axis=1).tolist()
        # With a stationary flange, nothing is measured.
        off = np.abs(y - product / max(square, _LEAST) * x)
        limit = _OUTLIER * max(_NORMAL * sorted(off.tolist())[count // 2], self._noise_N, _LEAST)
        weights = limit / np.maximum(off, limit)
        samples = float(total(weights))
        y, x = series = series - total(weights * series, axis=1, keepdims=True) / samples
        product, square = total(weights * x * series, axis=1).tolist()
        square = max(square - samples * self._blur_N2, ATTENUATED * square, _LEAST)
        share = product / square
        rest = y - share * x
        variance = max(float(total(weights * rest * rest)) / (samples - 2.0), self._noise_N**2, _LEAST)
        return share, DEVIATIONS_95 * sqrt(variance * _repetition(x, rest) / square)


def _repetition(x: Array, rest: Array) -> float:
    """Return the number of samples per independent sample for two autocorrelated series, such as a late force."""
    # M. S. Bartlett, "Some aspects of the time-correlation problem", 1935.
    count, lags = len(x), HALF_PERIOD_TICKS[1] - 1
    padded = np.zeros((2, count + lags - 1))
    padded[0, :count], padded[1, :count] = x, rest
    series, sample = padded.strides
    # A view of both series, shifted by each lag.
    shifted: Array = np.ndarray((lags, 2, count), buffer=padded, strides=(sample, series, sample))
    products = np.add.reduce(shifted * padded[:, :count], axis=2)
    correlated: list[float] = np.multiply.reduce(products, axis=1).tolist()
    return max(1.0 + 2.0 * fsum(correlated[1:]) / max(correlated[0], _LEAST**2), 1.0)
