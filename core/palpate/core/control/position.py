"""Position control of the tip."""

from __future__ import annotations

from palpate.core.checks import require_in
from palpate.core.control.law import limited
from palpate.core.values import Vector3


class PositionControl:
    """Moves towards the target at no more than a given speed: v = K (target - reference).

    Stability: with control period T the error shrinks by the factor 1 - K T each tick, so 0 < K T < 2; up to
    K T = 1 it never overshoots, and that is what is accepted.

    Args:
        gain_per_s: K.
        speed_limit_m_s: Top speed of the tip.
        period_s: Control period T.
    """

    def __init__(self, gain_per_s: float, speed_limit_m_s: float, period_s: float) -> None:
        require_in("control.position_gain_per_s", gain_per_s, 1e-3, 1.0 / period_s)
        require_in("control.speed_limit_m_s", speed_limit_m_s, 1e-6, 1.0)
        self._gain, self._speed = gain_per_s, speed_limit_m_s

    def velocity_m_s(self, reference_m: Vector3, target_m: Vector3, force_N: Vector3) -> Vector3:
        """See :class:`ControlLaw`; forces are ignored."""
        k = self._gain
        return limited(
            (
                k * (target_m[0] - reference_m[0]),
                k * (target_m[1] - reference_m[1]),
                k * (target_m[2] - reference_m[2]),
            ),
            self._speed,
        )

    def reset(self) -> None:
        """Nothing to forget."""
