"""The zero of the axial force during an insertion, which is confirmed by a drop or while the tool is stationary."""

from math import ceil, fsum, sqrt
from typing import Final

from palpate.core.job import MOST_SAMPLES
from palpate.core.ports import CONTROL_RATE_HZ
from palpate.core.tasks.contact import Monitor
from palpate.core.tasks.insertion.phases.equipment import Equipment

DEVIATIONS: Final = 3.3
"""Number of standard deviations in a decision; one error in two thousand is larger, on a given side."""
_SETTLE_TICKS: Final = MOST_SAMPLES
_LEAST_HALF_TICKS: Final = MOST_SAMPLES // 2
_MOST_HALVES: Final = 10
"""Settling time, minimum time for each force average, and number of averages. A servo takes a second to settle."""


class ForceZero:
    """Check for a drift of the axial force. With a drift, a tool presses ever harder while it appears to descend.

    Args:
        drift_N_per_tick: The slowest drift to be found.

    Attributes:
        drop_m: Length of a drop.
        seen: True once the zero has been confirmed in this insertion.
        ticks: Duration of the current hold.
    """

    def __init__(self, equipment: Equipment, monitor: Monitor, drift_N_per_tick: float) -> None:
        task, self._state, self._monitor = equipment.task, equipment.state, monitor
        self._measurement, self._motion = equipment.measurement, equipment.motion
        press_N, self._drift_N_per_tick = task.insertion_press_N, drift_N_per_tick
        # A peg that drops releases the gripper, which the pressing force has bent, and keeps falling without contact.
        self.drop_m = press_N / monitor.axial_N_per_m
        self._limit_m = (task.max_force_N - press_N) / monitor.axial_N_per_m

    def enter(self) -> None:
        """Begin an insertion."""
        self.seen = False
        self._dropped_m, self._zero_m = 0.0, self._motion.reference_m[2]
        self._last_m = self._zero_m
        # Noise changes a difference of two means by no more than the drift to be found.
        chance_N = DEVIATIONS * sqrt(2.0) * self._state.noise[2]
        self._half_ticks = max(_LEAST_HALF_TICKS, ceil((chance_N / self._drift_N_per_tick) ** (2.0 / 3.0)))

    def update(self) -> None:
        """Process a tick."""
        depth_m = self._motion.reference_m[2]
        # A drift may cancel the force of a contact, but not to within the noise for so far.
        free = abs(self._measurement.force_N[2]) < min(self._monitor.contact_N, DEVIATIONS * self._state.noise[2])
        self._dropped_m = self._dropped_m + max(depth_m - self._last_m, 0.0) if free else 0.0
        self._last_m = depth_m
        if self._dropped_m >= self.drop_m:
            self.seen, self._zero_m = True, depth_m

    @property
    def due(self) -> bool:
        """Return True if a drift in place of the descent since the last check would exceed the force limit."""
        return self._last_m - self._zero_m > self._limit_m

    def hold(self) -> None:
        """Begin to compare force averages; the tool must stay at its depth."""
        self.ticks, self._held_N = 0, list[float]()

    @property
    def settling(self) -> bool:
        """Return True while the force is not compared yet."""
        return self.ticks < _SETTLE_TICKS

    def confirmed(self) -> bool:
        """Process a tick of a hold; return True if the force is constant; report a mismatch if it drifts."""
        self.ticks += 1
        self._held_N.append(self._measurement.force_N[2])
        half = self._half_ticks
        halves, rest = divmod(self.ticks - _SETTLE_TICKS, half)
        if halves < 2 or rest:
            return False
        drift_N = (fsum(self._held_N[-half:]) - fsum(self._held_N[-2 * half : -half])) / half
        if drift_N <= self._drift_N_per_tick * half:
            self.seen, self._zero_m = True, self._last_m
            return True
        if halves == _MOST_HALVES:
            # The force of a peg that slips until it is relieved also decreases, but for a shorter time.
            rate_N_s = drift_N / half * CONTROL_RATE_HZ
            self._monitor.mismatch(f"the force changes by {rate_N_s:.2f} N/s while the tool is stationary")
        return False
