"""Force control: a contact force is regulated to its target."""

from __future__ import annotations

from palpate.core.checks import require_in
from palpate.core.control.law import limited
from palpate.core.errors import ConfigurationError
from palpate.core.values import Vector3


class ForceControl:
    """Proportional and integral force control in velocity form: v = k_i e + k_p de/dt, e = F - F_target.

    The tip's displacement is the integral of v, so k_i is the integral gain and k_p the proportional gain of a
    force controller that commands positions.

    Stability: against a contact of stiffness K and with control period T the loop e' = e - K (k_i T e + k_p
    (e - e_before)) is stable (Jury's criterion) when K k_p < 1 and K k_i T < 2 (1 - K k_p); half of that bound is
    accepted, the rest is left to the lag of servos and sensor.

    Args:
        integral_m_per_N_s: k_i.
        proportional_m_per_N: k_p.
        target_N: F_target, (3,), task frame.
        speed_limit_m_s: Top speed of the tip.
        stiffness_N_per_m: K, the stiffest contact expected.
        period_s: Control period T.
    """

    def __init__(
        self,
        integral_m_per_N_s: float,
        proportional_m_per_N: float,
        target_N: Vector3,
        speed_limit_m_s: float,
        stiffness_N_per_m: float,
        period_s: float,
    ) -> None:
        require_in("control.speed_limit_m_s", speed_limit_m_s, 1e-6, 1.0)
        require_in("control.force_proportional_m_per_N", proportional_m_per_N, 0.0, 0.5 / stiffness_N_per_m)
        highest = (1.0 - stiffness_N_per_m * proportional_m_per_N) / (stiffness_N_per_m * period_s)
        if not 0.0 < integral_m_per_N_s <= highest:
            raise ConfigurationError(
                "control.force_integral_m_per_N_s",
                integral_m_per_N_s,
                f"above 0 and at most {highest:.4g} m/(N s), or the contact oscillates"
                f" (stiffness {stiffness_N_per_m:.4g} N/m, period {period_s:.4g} s)",
            )
        self._integral, self._proportional = integral_m_per_N_s, proportional_m_per_N / period_s
        self._target, self._speed = target_N, speed_limit_m_s
        self._last: Vector3 | None = None

    def velocity_m_s(self, reference_m: Vector3, target_m: Vector3, force_N: Vector3) -> Vector3:
        """See :class:`ControlLaw`; positions are ignored."""
        target = self._target
        error = (force_N[0] - target[0], force_N[1] - target[1], force_N[2] - target[2])
        last = error if self._last is None else self._last
        self._last = error
        i, p = self._integral, self._proportional
        return limited(
            (
                i * error[0] + p * (error[0] - last[0]),
                i * error[1] + p * (error[1] - last[1]),
                i * error[2] + p * (error[2] - last[2]),
            ),
            self._speed,
        )

    def reset(self) -> None:
        """Forget the last error, so that a new contact does not begin with a kick."""
        self._last = None
