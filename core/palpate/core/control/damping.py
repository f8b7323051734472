"""Damping control: the tool moves as through a viscous medium, pushed by a nominal force."""

from __future__ import annotations

from palpate.core.checks import require_in
from palpate.core.control.law import limited
from palpate.core.errors import ConfigurationError
from palpate.core.values import Vector3


class DampingControl:
    """v = (F - F_nominal) / B (generalised damping; source paper, section 5.4 and its reference 4).

    In free space the tool moves at -F_nominal / B; in contact it comes to rest where the environment pushes back
    with F_nominal.

    Stability: against an environment (with the gripper in series) of stiffness K the force error shrinks by
    1 - K T / B each tick, so K T / B < 2; the lag of servos and sensor eats phase, so K T / B <= 0.5 is accepted.
    A force signal behind a 4 Hz filter would eat more than that: this law takes the unfiltered force.

    Args:
        damping_N_s_per_m: B.
        nominal_force_N: F_nominal, (3,), task frame; pressing into the hole's direction has a negative z.
        speed_limit_m_s: Top speed of the tip.
        stiffness_N_per_m: K, the stiffest contact expected.
        period_s: Control period T.
    """

    def __init__(
        self,
        damping_N_s_per_m: float,
        nominal_force_N: Vector3,
        speed_limit_m_s: float,
        stiffness_N_per_m: float,
        period_s: float,
    ) -> None:
        require_in("control.speed_limit_m_s", speed_limit_m_s, 1e-6, 1.0)
        lowest = 2.0 * stiffness_N_per_m * period_s
        if not lowest <= damping_N_s_per_m < float("inf"):
            raise ConfigurationError(
                "control.damping_N_s_per_m",
                damping_N_s_per_m,
                f"at least {lowest:.4g} N s/m, or pressing oscillates (2 x stiffness {stiffness_N_per_m:.4g} N/m"
                f" x period {period_s:.4g} s)",
            )
        self._mobility, self._nominal, self._speed = 1.0 / damping_N_s_per_m, nominal_force_N, speed_limit_m_s

    def velocity_m_s(self, reference_m: Vector3, target_m: Vector3, force_N: Vector3) -> Vector3:
        """See :class:`ControlLaw`; positions are ignored."""
        m, nominal = self._mobility, self._nominal
        return limited(
            (m * (force_N[0] - nominal[0]), m * (force_N[1] - nominal[1]), m * (force_N[2] - nominal[2])),
            self._speed,
        )

    def reset(self) -> None:
        """Nothing to forget."""
