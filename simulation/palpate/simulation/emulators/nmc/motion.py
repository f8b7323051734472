"""Motion of a servo's set-point with trapezoid and velocity profiles."""

from math import isqrt
from typing import Final

ONE_COUNT: Final = 1 << 16
"""Unit of positions, velocities and accelerations: 1/65536 of an encoder count (FACT, PIC-SERVO scaling)."""


class Profile:
    """The commanded position of a servo, advanced once per tick.

    Velocity words are counts/s * 65536 * T and acceleration words counts/s^2 * 65536 * T^2 with T the tick's length in
    s (FACT, PIC-SERVO; 33.554432 and 0.017179869 for T = 0.512 ms). All are integers, so a move ends exactly on its
    target. The firmware's rounding within a tick is not published. Here the ramp down uses the maximum velocity from
    which braking at the given acceleration still ends on the target (INFERENCE).

    Attributes:
        position: Commanded position in 1/65536 counts.
        velocity: Commanded velocity in 1/65536 counts per tick, signed.
    """

    def __init__(self) -> None:
        self.position = 0
        self.velocity = 0
        self.acceleration = 0
        self.done = True
        self.accelerated = True
        self.slewed = True
        self._target: int | None = None
        self._limit = 0

    @property
    def counts(self) -> int:
        """Commanded position in whole counts, rounded down."""
        return self.position >> 16

    def hold(self, counts: int) -> None:
        """Hold a position immediately."""
        self.position, self.velocity, self._target = counts * ONE_COUNT, 0, None
        self._limit = 0
        self.done = self.accelerated = self.slewed = True

    def shift(self, counts: int) -> None:
        """Move the position register's origin, which shifts all positions by the same number of counts."""
        self.position += counts * ONE_COUNT
        if self._target is not None:
            self._target += counts * ONE_COUNT

    def start_trapezoid(self, target_counts: int, velocity: int, acceleration: int) -> None:
        """Move to a position, starting at the current velocity (as version 10 of the chip allows)."""
        self._begin(acceleration)
        self._target, self._limit = target_counts * ONE_COUNT, velocity

    def start_velocity(self, velocity: int, acceleration: int) -> None:
        """Ramp to a signed velocity and keep it."""
        self._begin(acceleration)
        self._target, self._limit = None, velocity
        self.done = self.accelerated = self.velocity == velocity

    def tick(self) -> None:
        """Run one servo tick."""
        if self._target is not None:
            self._tick_trapezoid(self._target)
        elif self.velocity != self._limit:
            step = self.acceleration
            self.velocity += max(-step, min(step, self._limit - self.velocity))
            if self.velocity == self._limit:
                self.done = self.accelerated = True
        self.position += self.velocity

    def _begin(self, acceleration: int) -> None:
        self.acceleration = acceleration
        self.done = self.accelerated = self.slewed = False

    def _tick_trapezoid(self, target: int) -> None:
        remaining = target - self.position
        if remaining == 0 and abs(self.velocity) <= self.acceleration:
            self.velocity, self._limit, self._target = 0, 0, None
            self.done = self.accelerated = self.slewed = True
            return
        sign = 1 if remaining >= 0 else -1
        speed, step = self.velocity * sign, self.acceleration
        braking = _braking_speed(abs(remaining), step)
        wanted = min(self._limit, braking)
        if wanted <= speed + step:
            self.accelerated = True
        if braking < self._limit and wanted <= speed:
            self.slewed = True
        # A ramp never exceeds the acceleration; a target that came too near is overshot and approached again.
        self.velocity = sign * max(min(wanted, speed + step), speed - step)


def _braking_speed(distance: int, step: int) -> int:
    """Return the maximum velocity v from which braking covers (k + 1) v - a k (k + 1) / 2, with k = floor(v / a)."""
    if step <= 0:
        return distance
    k = (isqrt(1 + 8 * distance // step) - 1) // 2
    return (distance + step * k * (k + 1) // 2) // (k + 1)
