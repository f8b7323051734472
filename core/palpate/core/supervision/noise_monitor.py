"""Force sensor liveness check: live channels have noise, and their samples never repeat."""

from collections import deque
from collections.abc import Sequence
from math import fsum, nan, sqrt
from typing import Final, TypeAlias

from palpate.core.ports import SensorFacts, Snapshot
from palpate.core.supervision.config import SupervisionConfig
from palpate.core.trial import PhaseConstraints, TaskConfig, Trip, TripReason

BAND: Final = 1.0 / 3.0
"""Half-width of the band that counts as flat, in standard deviations of the channel's noise.

White noise stays within this distance of its start for 20 samples with a probability of 1.9e-12, the integral of phi(x)
(Phi(x + 1/3) - Phi(x - 1/3))^19 over x; in 1000 trials of 2000 ticks on six channels, this means 2e-5 false trips. A
dead channel with a twentieth of the noise stays within it with a probability close to one.
"""
_FEWEST: Final = 8
"""Minimum number of samples for a meaningful standard deviation."""
CHANNELS: Final = ("Fx", "Fy", "Fz", "Tx", "Ty", "Tz")
_Six: TypeAlias = tuple[float, float, float, float, float, float]
_FORCES: Final = 3
_DIGITS: Final = 6
"""Number of decimals in the ratio, because a gain rounds each sample. Identical ratios occur by chance about once in
several thousand."""


class NoiseMonitor:
    """Monitor that compares each channel with its noise and each new sample with earlier samples.

    Flat lines: a channel that stays within :data:`BAND` of its noise for the number of samples in the settings is dead,
    even if its amplifier adds noise (QARTOD's flat line test, with the sensor's noise as the tolerance). The noise is
    the value given in the sensor's facts, or the value measured during taring if that is smaller.

    Noise: nothing moves during taring, so noise far above the declared value indicates a wrong scale or a broken wire.

    Repetition: samples that repeat earlier ones in order, with any gain and offset, are a recording.

    Args:
        sensor: The sensor's noise; channels without noise, in a simulated cell, are not monitored.
    """

    def __init__(self, config: SupervisionConfig, task: TaskConfig, sensor: SensorFacts) -> None:
        force, torque = sensor.noise_N, sensor.noise_Nm
        self._noise: _Six = (force, force, force, torque, torque, torque)
        self._longest, self._most_ratio = config.flat_line_samples - 1, config.max_noise_ratio
        self._most_recurring = config.max_recurring_samples
        self._still: deque[tuple[int, _Six]] = deque(maxlen=task.tare_ticks)
        # A slow sensor needs longer for the same number of samples; the tool was stationary for as long before taring.
        self._still_ticks = 2 * task.tare_ticks

    def begin(self) -> None:
        """Reset the state for a new trial."""
        self._sequence: int | None = None
        self._still.clear()
        self._tared = False
        self._band = _bands(self._noise)
        # NaN equals no sample, so the first one begins a run on each channel.
        self._begun, self._since = [nan] * 6, [0] * 6
        self._seen: dict[float, int] = {}
        self._count = self._lag = 0
        self._recurring: int
        self._total = self._change = 0.0

    def trip(self, snapshot: Snapshot, constraints: PhaseConstraints) -> Trip | None:
        """Return the trip for the current, valid wrench, or None if the wrench is acceptable."""
        wrench = snapshot.wrench
        if wrench.sequence == self._sequence:
            return None
        self._sequence = wrench.sequence
        if not self._tared:
            trip = self._taring(snapshot, constraints)
            if trip is not None:
                return trip
        count = self._count = self._count + 1
        total = 0.0
        for channel, value in enumerate((*wrench.force_N, *wrench.torque_Nm)):
            total += value
            # Most samples begin a new run.
            if not abs(value - self._begun[channel]) <= self._band[channel]:
                self._begun[channel], self._since[channel] = value, count
            elif self._since[channel] <= count - self._longest:
                return self._flat(snapshot.tick, channel)
        # One number replaces six for hashing; several repetitions in order are still no coincidence. The ratio of two
        # changes is invariant to gain and offset.
        last = self._change
        change, self._total = total - self._total, total
        self._change, seen = change, self._seen
        key = round(change / last, _DIGITS) if last else 0.0
        before = seen.get(key)
        seen[key] = count
        if before is not None:
            return self._recurs(snapshot.tick, count - before)
        self._recurring = 0
        return None

    def _taring(self, snapshot: Snapshot, constraints: PhaseConstraints) -> Trip | None:
        """Collect samples until the task has its bias, then compare their deviation with the noise."""
        wrench, still = snapshot.wrench, self._still
        still.append((snapshot.tick, (*wrench.force_N, *wrench.torque_Nm)))
        if constraints.bias is None:
            return None
        self._tared = True
        samples = [values for tick, values in still if tick > snapshot.tick - self._still_ticks]
        if len(samples) < _FEWEST:
            return None
        shown = [_deviation(values) for values in zip(*samples, strict=True)]
        for name, found, noise in zip(CHANNELS, shown, self._noise, strict=True):
            if noise > 0.0 and not found <= self._most_ratio * noise:
                ratio, limit = found / noise, self._most_ratio
                text = f"{name} shows {ratio:.1f} times the sensor's rated noise at standstill, limit {limit:g}"
                return Trip(TripReason.SENSOR_NOISE, snapshot.tick, text, "force")
        self._band = _bands([min(pair) for pair in zip(shown, self._noise, strict=True)])
        return None

    def _flat(self, tick: int, place: int) -> Trip:
        most = self._longest + 1
        name, unit = CHANNELS[place], "N" if place < _FORCES else "N m"
        text = f"{name} stayed within {self._band[place]:.3g} {unit} for {most} new samples: its noise is missing"
        return Trip(TripReason.CHANNEL_FLAT, tick, text, "force")

    def _recurs(self, tick: int, lag: int) -> Trip | None:
        last, self._lag = self._lag, lag
        # Equality with the previous sample is checked by another monitor.
        self._recurring = self._recurring + 1 if lag == last and lag > 1 else 1
        found, most = self._recurring, self._most_recurring
        if found <= most:
            return None
        text = f"{found} consecutive new force samples repeat earlier ones, {lag} samples ago; limit {most}"
        return Trip(TripReason.SAMPLES_RECUR, tick, text, "force")


def _deviation(values: Sequence[float]) -> float:
    """Return the sample standard deviation; the standard library's exact version is too slow."""
    mean = fsum(values) / len(values)
    return sqrt(fsum((value - mean) ** 2 for value in values) / (len(values) - 1))


def _bands(noise: Sequence[float]) -> _Six:
    """Return the half-widths of the bands; for a channel without noise, no value is inside the band."""
    a, b, c, d, e, f = (BAND * each if each > 0.0 else -1.0 for each in noise)
    return (a, b, c, d, e, f)
