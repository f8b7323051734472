"""Hybrid compliant motion: each axis under the law that suits it."""

from __future__ import annotations

from palpate.core.control.law import ControlLaw
from palpate.core.values import Vector3


class HybridControl:
    """One law across the tool axis (x and y), another along it (z).

    The paper's exploratory motion is position control in x and y with damping control in z (section 5.4); the
    insertion uses force control in x and y with damping control in z. The two laws act on orthogonal directions, so
    the combination is stable when each of them is.

    Args:
        across: Law for x and y.
        along: Law for z.
    """

    def __init__(self, across: ControlLaw, along: ControlLaw) -> None:
        self._across, self._along = across, along

    def velocity_m_s(self, reference_m: Vector3, target_m: Vector3, force_N: Vector3) -> Vector3:
        """See :class:`ControlLaw`. Each law sees only its own axes, so the limits of one do not slow the other."""
        fx, fy, fz = force_N
        rx, ry, rz = reference_m
        tx, ty, tz = target_m
        vx, vy, _ = self._across.velocity_m_s((rx, ry, 0.0), (tx, ty, 0.0), (fx, fy, 0.0))
        _, _, vz = self._along.velocity_m_s((0.0, 0.0, rz), (0.0, 0.0, tz), (0.0, 0.0, fz))
        return vx, vy, vz

    def reset(self) -> None:
        """Both laws forget the past."""
        self._across.reset()
        self._along.reset()
