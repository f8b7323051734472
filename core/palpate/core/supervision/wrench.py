"""Is the force on the tool what it may be? Unfiltered, because a filter lags by half an action."""

from __future__ import annotations

from math import sqrt

from palpate.core.supervision.values import Expectation, Trip, TripReason
from palpate.core.supervision_config import SupervisionConfig
from palpate.core.task_config import CONTROL_RATE_HZ
from palpate.core.values import Snapshot, Vector3

_SHORTEST_NS = 1_000_000_000 // CONTROL_RATE_HZ // 2
"""Samples that lie closer together would turn their noise into a rate."""


class WrenchWatch:
    """Force, torque, the rate of the force, and contact where none is expected.

    Args:
        config: The limits.
        scale: Factors on the sensor's six channels after taring, (6,).
    """

    def __init__(self, config: SupervisionConfig, scale: tuple[float, ...]) -> None:
        self._force_N, self._torque_Nm = config.max_force_N, config.max_torque_Nm
        self._rate_N_s, self._contact_N = config.max_force_rate_N_s, config.unexpected_contact_N
        self._force_square, self._torque_square = self._force_N**2, self._torque_Nm**2
        self._rate_N_ns, self._contact_square = self._rate_N_s * 1e-9, self._contact_N**2
        self._scale = scale
        self.begin()

    def begin(self) -> None:
        """A trial begins."""
        self._first: tuple[float, float, float, float, float, float] | None = None
        self._free: Vector3 | None = None
        self._sequence: int | None = None
        self._last: Vector3 = (0.0, 0.0, 0.0)
        self._last_ns = 0

    def trip(self, snapshot: Snapshot, expectation: Expectation) -> Trip | None:
        """What is wrong with this tick's wrench, which is valid; None if nothing is."""
        wrench, bias = snapshot.wrench, expectation.bias
        fx, fy, fz = wrench.force_N
        tx, ty, tz = wrench.torque_Nm
        if self._first is None:
            self._first = (fx, fy, fz, tx, ty, tz)
            self._last, self._last_ns, self._sequence = wrench.force_N, wrench.source_time_ns, wrench.sequence
        a, b, c, d, e, f = self._first if bias is None else bias
        kx, ky, kz, lx, ly, lz = self._scale
        x, y, z = (fx - a) * kx, (fy - b) * ky, (fz - c) * kz
        square = x * x + y * y + z * z
        # All comparisons are written so that a number that is none trips, too.
        if not square <= self._force_square:
            return _exceeded(TripReason.FORCE_LIMIT, snapshot.tick, "force", sqrt(square), self._force_N, bias)
        p, q, r = (tx - d) * lx, (ty - e) * ly, (tz - f) * lz
        torque = p * p + q * q + r * r
        if not torque <= self._torque_square:
            return _exceeded(
                TripReason.TORQUE_LIMIT, snapshot.tick, "torque", sqrt(torque), self._torque_Nm, bias, "N m"
            )
        if wrench.sequence != self._sequence:
            self._sequence = wrench.sequence
            u, v, w = self._last
            self._last = wrench.force_N
            last_ns, self._last_ns = self._last_ns, wrench.source_time_ns
            x, y, z = (fx - u) * kx, (fy - v) * ky, (fz - w) * kz
            change, dt_ns = x * x + y * y + z * z, max(self._last_ns - last_ns, _SHORTEST_NS)
            most = self._rate_N_ns * dt_ns
            if not change <= most * most:
                rate, limit = sqrt(change) / dt_ns * 1e9, self._rate_N_s
                text = f"force changed at {rate:.0f} N/s, limit {limit:g} N/s"
                return Trip(TripReason.FORCE_RATE, snapshot.tick, rate, limit, text)
        if expectation.contact:
            self._free = None
            return None
        return self._contact(snapshot, square, bias is not None)

    def _contact(self, snapshot: Snapshot, square: float, tared: bool) -> Trip | None:
        """Before taring weight and offset are unknown: what counts is the change since this phase began."""
        if not tared:
            if self._free is None:
                self._free = snapshot.wrench.force_N
            (fx, fy, fz), (u, v, w) = snapshot.wrench.force_N, self._free
            kx, ky, kz = self._scale[:3]
            x, y, z = (fx - u) * kx, (fy - v) * ky, (fz - w) * kz
            square = x * x + y * y + z * z
        if square <= self._contact_square:
            return None
        force, limit = sqrt(square), self._contact_N
        text = f"force {force:.2f} N where nothing may be touched, limit {limit:g} N"
        return Trip(TripReason.UNEXPECTED_CONTACT, snapshot.tick, force, limit, text)


def _exceeded(
    reason: TripReason, tick: int, what: str, value: float, limit: float, bias: object, unit: str = "N"
) -> Trip:
    since = " more than at the start, before taring" if bias is None else ""
    return Trip(reason, tick, value, limit, f"{what} {value:.2f} {unit}{since}, limit {limit:g} {unit}")
