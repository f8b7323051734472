"""Hybrid compliant motion, with a controller for each axis."""

from abc import abstractmethod
from math import sqrt
from typing import Protocol

from palpate.core.errors import ConfigurationError, require_in
from palpate.core.ports import Vector3


class Controller(Protocol):
    """Interface for controllers, which compute the tip reference's velocity until the next control tick."""

    @abstractmethod
    def velocity_m_s(self, reference_m: Vector3, target_m: Vector3, force_N: Vector3) -> Vector3:
        """Return the tip velocity, (3,), in the task frame.

        Args:
            reference_m: Commanded tip position, (3,), task frame.
            target_m: Position at the end of the action, (3,), task frame.
            force_N: Force exerted by the environment on the tool, tared but not low-pass filtered, (3,), task frame.
        """

    def reset(self) -> None:
        """Clear the controller's state; called when an action with a different controller begins."""
        # Most controllers have no state.
        return


def limited(velocity_m_s: Vector3, speed_limit_m_s: float) -> Vector3:
    """Scale a velocity to the speed limit without changing its direction."""
    x, y, z = velocity_m_s
    square = x * x + y * y + z * z
    if square <= speed_limit_m_s * speed_limit_m_s:
        return velocity_m_s
    shrink = speed_limit_m_s / sqrt(square)
    return x * shrink, y * shrink, z * shrink


class HybridControl(Controller):
    """A controller across the tool axis (x and y) combined with a controller along it (z).

    The paper's exploratory motion is position control in x and y with damping control in z (section 5.4); the insertion
    uses force control in x and y with damping control in z. The controllers act on orthogonal directions, so the
    combination is stable if each of them is.
    """

    def __init__(self, across: Controller, along: Controller) -> None:
        self._across, self._along = across, along

    def velocity_m_s(self, reference_m: Vector3, target_m: Vector3, force_N: Vector3) -> Vector3:
        """Return the combined velocity; one controller's limits do not slow the other's axes."""
        fx, fy, fz = force_N
        rx, ry, rz = reference_m
        tx, ty, tz = target_m
        vx, vy, _ = self._across.velocity_m_s((rx, ry, 0.0), (tx, ty, 0.0), (fx, fy, 0.0))
        _, _, vz = self._along.velocity_m_s((0.0, 0.0, rz), (0.0, 0.0, tz), (0.0, 0.0, fz))
        return vx, vy, vz

    def reset(self) -> None:
        """Clear both controllers' state."""
        self._across.reset()
        self._along.reset()


class DampingControl(Controller):
    """Generalised damping control: v = (F - F_nominal) / B (source paper, section 5.4 and its reference 4).

    In free space the tool moves at -F_nominal / B; in contact it stops where the reaction force is F_nominal.

    Stability: with an environment (in series with the gripper) of stiffness K, the force error is multiplied by 1 - K T
    / B each tick, so K T / B < 2 is required. Servo and sensor lag reduces the phase margin, so K T / B must be
    at most 0.5. A 4 Hz filter would reduce it further, so this controller uses the unfiltered force.

    Args:
        damping_N_s_per_m: Damping B.
        nominal_force_N: Force F_nominal, (3,), task frame; z is negative for pressing into the hole.
        stiffness_N_per_m: Stiffness K of the stiffest expected contact.
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
        """Return the tip velocity; positions are ignored."""
        m, (fx, fy, fz), (x, y, z) = self._mobility, force_N, self._nominal
        return limited((m * (fx - x), m * (fy - y), m * (fz - z)), self._speed)


class PositionControl(Controller):
    """Position control towards the target at limited speed: v = K (target - reference).

    Stability: with control period T the error is multiplied by 1 - K T each tick, so 0 < K T < 2 is required; K T must
    be at most 1, which excludes overshoot.

    Args:
        gain_per_s: Gain K.
        period_s: Control period T.
    """

    def __init__(self, gain_per_s: float, speed_limit_m_s: float, period_s: float) -> None:
        require_in("control.position_gain_per_s", gain_per_s, 1e-3, 1.0 / period_s)
        require_in("control.speed_limit_m_s", speed_limit_m_s, 1e-6, 1.0)
        self._gain, self._speed = gain_per_s, speed_limit_m_s

    def velocity_m_s(self, reference_m: Vector3, target_m: Vector3, force_N: Vector3) -> Vector3:
        """Return the tip velocity; forces are ignored."""
        k, (tx, ty, tz), (x, y, z) = self._gain, target_m, reference_m
        return limited((k * (tx - x), k * (ty - y), k * (tz - z)), self._speed)


class ForceControl(Controller):
    """Proportional and integral force control in velocity form: v = k_i e + k_p de/dt, e = F - F_target.

    The tip's displacement is the integral of v. Therefore k_i is the integral gain and k_p the proportional gain of a
    force controller that commands positions.

    Stability: with a contact of stiffness K and control period T the loop e' = e - K (k_i T e + k_p (e - e_before)) is
    stable (Jury's criterion) if K k_p < 1 and K k_i T < 2 (1 - K k_p). Half of that bound is accepted, because of
    servo and sensor lag.

    Args:
        integral_m_per_N_s: Integral gain k_i.
        proportional_m_per_N: Proportional gain k_p.
        target_N: Force F_target, (3,), task frame.
        stiffness_N_per_m: Stiffness K of the stiffest expected contact.
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
        """Return the tip velocity; positions are ignored."""
        (fx, fy, fz), (tx, ty, tz) = force_N, self._target
        x, y, z = error = fx - tx, fy - ty, fz - tz
        u, v, w = error if self._last is None else self._last
        self._last = error
        i, p = self._integral, self._proportional
        return limited((i * x + p * (x - u), i * y + p * (y - v), i * z + p * (z - w)), self._speed)

    def reset(self) -> None:
        """Clear the last error so that a new contact does not start with a jump."""
        self._last = None
