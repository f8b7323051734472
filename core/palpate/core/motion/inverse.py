"""Inverse kinematics: damped least squares with joint limits, one step per control tick.

The solver uses Pinocchio's Jacobian without a quadratic program: for six joints the step has an exact solution, takes a
few microseconds, and the only inequality constraints are joint bounds (``docs/decisions/0004-inverse-kinematics.md``
compares it with pin-pink). A seventh joint's null-space motion is towards the arm's posture, slowly enough not to
delay the tip.

Linear equations are solved with Eigen. LAPACK selects its kernels by processor; with Eigen, identical inputs give
identical bytes on all machines (``docs/decisions/0015-equal-on-another-processor.md``).
"""

from collections.abc import Iterator
from math import prod
from operator import add, le
from typing import Final

import numpy as np
import pinocchio as pin
from eigenpy import LLT, PartialPivLU

from palpate.core.errors import UnreachableError
from palpate.core.motion.model import Array, Kinematics
from palpate.core.ports import JointVector, Vector3

_DAMPING: Final = 1e-12  # squared; small compared with 1, so that a step far from singularities is exact to 1e-9
_SINGULAR: Final = 2e-4  # below this product of singular values (m^3 rad^3 scale) the damping grows
_MAX_DAMPING: Final = 1e-2
_ITERATION_REACH_RAD: Final = 0.3
_POSTURE_S: Final = 1.0  # time constant with which a redundant arm returns to its posture
_POSTURE_SHARE: Final = 0.2  # largest fraction of the joints' step that this return may use
_SETTLED_RAD: Final = 1e-6


class InverseKinematics:
    """Inverse kinematics that tracks a moving tip placement.

    Args:
        kinematics: An unshared instance; every call changes it.
        period_s: Time between two steps; with the velocity limits it bounds each step.
    """

    def __init__(self, kinematics: Kinematics, period_s: float) -> None:
        self._kinematics = kinematics
        self._square = kinematics.joints == 6
        self._posture: Array | None = None if kinematics.joints <= 6 else np.array(kinematics.arm.posture_rad)
        self._towards_posture = period_s / _POSTURE_S
        # Reused, because creating one takes longer than the factorisation.
        self._factors = PartialPivLU(kinematics.joints)
        self._lower: list[float] = kinematics.lower_rad.tolist()
        self._upper: list[float] = kinematics.upper_rad.tolist()
        self._reach_rad: Array = kinematics.velocity_limit_rad_s * period_s
        self._least_reach_rad = float(self._reach_rad.min())

    def step(self, q_rad: JointVector, tip_target_in_base: pin.SE3) -> tuple[JointVector, bool]:
        """Take one Gauss-Newton step from joint angles, (n,), towards a tip placement.

        Near a singularity the damping increases; the step stays bounded and loses accuracy. A joint at its limit is
        removed and the others compensate. A step beyond the velocity limits is scaled as a whole, so the tip keeps its
        direction.

        Returns:
            New joint angles, (n,), and True if a limit or a singularity prevented the tip from reaching its target. An
            angle beyond its limits can only move back towards them.
        """
        jacobian = self._kinematics.tip_jacobian(q_rad)
        error = self._kinematics.tip_error(tip_target_in_base)
        # Nearly every tick returns from this block. Plain floats: a numpy call on six numbers costs a microsecond.
        if self._square:
            factors = self._factors
            factors.compute(jacobian)
            # The determinant is the product of the singular values and thus the manipulability.
            if abs(factors.determinant()) >= _SINGULAR:
                change_rad = factors.solve(error).tolist()
                new_rad = tuple(map(add, q_rad, change_rad))
                inside = all(map(le, self._lower, new_rad)) and all(map(le, new_rad, self._upper))
                reach_rad = self._least_reach_rad
                if inside and -reach_rad <= min(change_rad) and max(change_rad) <= reach_rad:
                    return new_rad, False
        q, limited = self._limited_step(np.array(q_rad), jacobian, error, self._reach_rad, self._towards_posture)
        return tuple(q.tolist()), limited

    def solve(self, tip_target_in_base: pin.SE3, *, free_yaw: bool, seed_rad: Array, field: str) -> Array:
        """Find joint angles for a placement iteratively from a seed.

        Args:
            free_yaw: True leaves the rotation about the tool axis free.
            seed_rad: Initial angles, (n,); they select the solution branch.
            field: Setting to name in the error if there is no solution.

        Returns:
            Joint angles, (n,), with the tip within 1 micrometre and 1 microradian.

        Raises:
            UnreachableError: No configuration within the joint limits was found.
        """
        kinematics = self._kinematics
        reach = np.full(kinematics.joints, _ITERATION_REACH_RAD)
        for q in self._starts(seed_rad):
            for _ in range(100):
                jacobian = kinematics.tip_jacobian(q)
                if free_yaw:
                    error, jacobian = _axis_error(kinematics.tip_in_base, tip_target_in_base), jacobian[:5]
                else:
                    error = kinematics.tip_error(tip_target_in_base)
                before = q
                q, _ = self._limited_step(before, jacobian, error, reach, 0.5)
                settled = self._posture is None or float(np.abs(q - before).max()) < _SETTLED_RAD
                if settled and float(np.abs(error).max()) < 1e-6:
                    return before
        position = ", ".join(f"{1e3 * value:.4g}" for value in tip_target_in_base.translation)
        raise UnreachableError(
            field,
            f"({position}) mm",
            f"a place that {kinematics.arm.name} reaches with the required tool axis and tool.tip_mm",
        )

    def turning(self, q_rad: JointVector, axis: Vector3) -> list[float]:
        """Return the joint velocities, (n,), that turn the tip in place at 1 rad/s about an axis, (3,), tip frame."""
        rates, _ = self._damped_least_squares(
            self._kinematics.tip_jacobian(q_rad), np.array((0.0, 0.0, 0.0, *axis)), None
        )
        turning: list[float] = rates.tolist()
        return turning

    def _starts(self, seed_rad: Array) -> Iterator[Array]:
        kinematics = self._kinematics
        yield np.clip(seed_rad, kinematics.lower_rad, kinematics.upper_rad)
        # Fixed seed: the result depends on the inputs only.
        rng = np.random.default_rng(0)
        low, high = np.maximum(kinematics.lower_rad, -np.pi), np.minimum(kinematics.upper_rad, np.pi)
        for _ in range(20):
            yield rng.uniform(low, high)

    def _limited_step(
        self, q: Array, jacobian: Array, error: Array, reach_rad: Array, towards_posture: float
    ) -> tuple[Array, bool]:
        # A joint already outside its limits (by an encoder's rounding, for example) may stay or move inwards.
        lower, upper = np.minimum(self._kinematics.lower_rad, q), np.maximum(self._kinematics.upper_rad, q)
        free, pull = jacobian, self._pull(q, reach_rad, towards_posture)
        limited = False
        for _ in range(len(q)):
            dq, singular = self._damped_least_squares(free, error, pull)
            limited = limited or singular
            target = q + dq
            beyond = (target < lower) | (target > upper)
            if not beyond.any():
                break
            limited = True
            free = np.where(beyond, 0.0, free)
            pull = None if pull is None else np.where(beyond, 0.0, pull)
        else:
            dq = np.zeros_like(q)
        excess = float((np.abs(dq) / reach_rad).max())
        if excess > 1.0:
            dq, limited = dq / excess, True
        return q + dq, limited

    def _pull(self, q: Array, reach_rad: Array, share: float) -> Array | None:
        """Return the step that moves a redundant arm towards its posture, ignoring the tip."""
        if self._posture is None:
            return None
        pull: Array = (self._posture - q) * share
        excess = float((np.abs(pull) / reach_rad).max()) / _POSTURE_SHARE
        return pull / excess if excess > 1.0 else pull

    def _damped_least_squares(self, jacobian: Array, error: Array, pull: Array | None) -> tuple[Array, bool]:
        gram = np.einsum("ik,jk->ij", jacobian, jacobian)
        gram.flat[:: len(gram) + 1] += _DAMPING
        factors = LLT(gram)
        # As above, from the diagonal of the Cholesky factor.
        manipulability = prod(factors.matrixLLT().diagonal().tolist())
        singular = manipulability < _SINGULAR
        if singular:
            gram.flat[:: len(gram) + 1] += _MAX_DAMPING * (1.0 - manipulability / _SINGULAR) ** 2
            factors = LLT(gram)
        if pull is None:
            return np.einsum("ij,i->j", jacobian, factors.solve(error)), singular
        # The solution nearest to the pull: the component of the pull that moves the tip is removed.
        rest = error - np.einsum("ij,j->i", jacobian, pull)
        return pull + np.einsum("ij,i->j", jacobian, factors.solve(rest)), singular


def _axis_error(tip: pin.SE3, target: pin.SE3) -> Array:
    """Return the ``Kinematics.tip_error`` twist without the rotation about the tool axis, (5,)."""
    target_in_tip = tip.actInv(target)
    x, y, z = target_in_tip.rotation[:, 2].tolist()
    turn = (-y, x) if z > 0.0 else (1.0, 0.0)
    return np.concatenate((target_in_tip.translation, turn))
