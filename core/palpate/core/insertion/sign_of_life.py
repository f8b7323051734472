"""Is the force sensor alive while the tool slides? Only so far may it go without a sign of it."""

from __future__ import annotations

from math import hypot, inf, sqrt
from typing import Final

from palpate.core.ports import Vector3, WrenchSample

FREE_WAY_M: Final = 8e-4
"""Travel without a sign of life after which the tool stops for a check. A peg that caught on something meanwhile has
bent the gripper by no more than that: 32 N across at 40 N/mm."""
_FEWEST: Final = 10
"""Differences of samples below which nothing is concluded."""
_CORRELATION: Final = 0.6
_DEVIATIONS: Final = 8.0
"""How far the sum of products has to be above what the sensor's noise alone gives, in standard deviations."""


class SignOfLife:
    """Holds changes of the lateral force against changes of the torque about the sensor.

    A force across the tool axis reaches the sensor over the tool's lever and shows in the torque, too. A tool that
    slides sticks and slips, so force and torque change together; a sensor that is dead has noise in either, without a
    relation. The changes of force and torque are correlated over all samples since the last sign.

    Args:
        lever_m: Distance from the sensor's origin to the tool's tip along the tool axis.
    """

    def __init__(self, lever_m: float) -> None:
        self._sign = 1.0 if lever_m >= 0.0 else -1.0
        self.begin()

    def begin(self) -> None:
        """A trial begins; the noise of the sensor is not known yet."""
        self._last: WrenchSample | None = None
        self._force_square = self._torque_square = 0.0
        self._quiet = 0
        self._place: tuple[float, float] | None = None
        self.travel_m = 0.0
        self._restart()

    def rest(self, wrench: WrenchSample) -> None:
        """A sample of a tool at rest in free space: its changes are the sensor's noise."""
        last, self._last = self._last, wrench
        if last is not None and wrench.sequence != last.sequence:
            dx, dy, dp, dq = _changes(last, wrench)
            self._force_square += dx * dx + dy * dy
            self._torque_square += dp * dp + dq * dq
            self._quiet += 1

    def resume(self) -> None:
        """The slide begins, here or anew: what changed since the last sample is none of its changes."""
        self._last = None

    def watch(self, wrench: WrenchSample, reference_m: Vector3) -> None:
        """A sample of a tool that presses on the plate, commanded to this place, task frame."""
        place, self._place = self._place, reference_m[:2]
        if place is not None:
            self.travel_m += hypot(reference_m[0] - place[0], reference_m[1] - place[1])
        last, self._last = self._last, wrench
        if last is None or wrench.sequence == last.sequence:
            return
        dx, dy, dp, dq = _changes(last, wrench)
        # Torque about the sensor of a force (fx, fy) at the lever l: (-l fy, l fx).
        self._product += self._sign * (dq * dx - dp * dy)
        self._force += dx * dx + dy * dy
        self._torque += dp * dp + dq * dq
        self._count += 1
        if self._count >= _FEWEST and self._alive():
            self.proved()

    def proved(self) -> None:
        """The sensor has answered, here or to a check: travel counts from now on."""
        self.travel_m = 0.0
        self._restart()

    def demand_check(self) -> None:
        """A check is due for another reason."""
        self.travel_m = inf

    @property
    def due(self) -> bool:
        """Whether the tool has gone as far as it may without a sign of life."""
        return self.travel_m > FREE_WAY_M

    def _alive(self) -> bool:
        product = self._product
        if product <= _CORRELATION * sqrt(self._force * self._torque):
            return False
        noise = 0.0
        if self._quiet:
            # Sums over two channels: a product of noise alone has half the product of their mean squares as variance.
            noise = sqrt(0.5 * self._count * self._force_square * self._torque_square) / self._quiet
        return product > _DEVIATIONS * noise

    def _restart(self) -> None:
        self._product = self._force = self._torque = 0.0
        self._count = 0


def _changes(last: WrenchSample, now: WrenchSample) -> tuple[float, float, float, float]:
    """Changes of Fx, Fy, Tx, Ty."""
    return (
        now.force_N[0] - last.force_N[0],
        now.force_N[1] - last.force_N[1],
        now.torque_Nm[0] - last.torque_Nm[0],
        now.torque_Nm[1] - last.torque_Nm[1],
    )
