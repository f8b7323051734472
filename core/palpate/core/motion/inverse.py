"""Inverse kinematics: damped least squares with joint limits, one step a control tick.

Our own few lines on Pinocchio's Jacobian rather than a quadratic program: the step has an exact answer for
six joints, costs a few microseconds, and its only inequality constraints are boxes on the joints
(``docs/decisions/0004-inverse-kinematics.md`` has the comparison with pin-pink). What a seventh joint leaves free
goes towards the arm's posture, slowly enough that it never holds up the tip.

Eigen solves, and not LAPACK, whose kernels are chosen by the processor: equal inputs give equal bytes on the
next machine too (``docs/decisions/0015-equal-on-another-processor.md``).
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

_DAMPING: Final = 1e-12  # squared; small against 1, so that a step far from singularities is exact to 1e-9
_SINGULAR: Final = 2e-4  # below this product of singular values (m^3 rad^3 scale) the damping grows
_MAX_DAMPING: Final = 1e-2
_ITERATION_REACH_RAD: Final = 0.3
_POSTURE_S: Final = 1.0  # time constant with which a redundant arm goes back to its posture
_POSTURE_SHARE: Final = 0.2  # of the joints' reach in one step, at most, for going there
_SETTLED_RAD: Final = 1e-6


class InverseKinematics:
    """Follows a moving tip placement with the joints.

    Args:
        kinematics: A work space of its own (it is changed by every call).
        period_s: Time between two steps; with the velocity limits it bounds each step.
    """

    def __init__(self, kinematics: Kinematics, period_s: float) -> None:
        self._kinematics = kinematics
        self._square = kinematics.joints == 6
        self._posture: Array | None = None if kinematics.joints <= 6 else np.array(kinematics.arm.posture_rad)
        self._towards_posture = period_s / _POSTURE_S
        # Kept, because making one takes longer than the factorisation itself.
        self._factors = PartialPivLU(kinematics.joints)
        self._lower: list[float] = kinematics.lower_rad.tolist()
        self._upper: list[float] = kinematics.upper_rad.tolist()
        self._reach_rad: Array = kinematics.velocity_limit_rad_s * period_s
        self._least_reach_rad = float(self._reach_rad.min())

    def step(self, q_rad: JointVector, tip_target_in_base: pin.SE3) -> tuple[JointVector, bool]:
        """One Gauss-Newton step from joint angles, (n,), towards a tip placement.

        Near a singularity the damping grows, so that the step stays bounded and loses accuracy instead. A
        joint at its limit is taken out and the others share its work. A step beyond the velocity limits is
        shortened as a whole, so that the tip keeps its direction.

        Returns:
            New joint angles, (n,), none beyond its limits, unless it was before and is on its way back; and whether a
            limit or a singularity kept the tip from getting all the way.
        """
        jacobian = self._kinematics.tip_jacobian(q_rad)
        error = self._kinematics.tip_error(tip_target_in_base)
        # Nearly every tick ends in this block. Plain floats: a numpy call on six numbers costs a microsecond.
        if self._square:
            factors = self._factors
            factors.compute(jacobian)
            # The determinant is the product of the singular values: manipulability for free.
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
        """Joint angles that reach a placement, found by iteration from a seed.

        Args:
            free_yaw: Leave the rotation about the tool axis to the arm.
            seed_rad: Where to start, (n,); it picks the branch of the solution.
            field: The setting to name when there is no solution.

        Returns:
            Joint angles, (n,), tip within 1 micrometre and 1 microradian.

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
            f"a place that {kinematics.arm.name} reaches with its tool axis as asked and tool.tip_mm as stated",
        )

    def turning(self, q_rad: JointVector, axis: Vector3) -> list[float]:
        """Joint velocities, (n,), that turn the tip in its place at 1 rad/s about an axis, (3,), tip frame."""
        rates, _ = self._damped_least_squares(
            self._kinematics.tip_jacobian(q_rad), np.array((0.0, 0.0, 0.0, *axis)), None
        )
        turning: list[float] = rates.tolist()
        return turning

    def _starts(self, seed_rad: Array) -> Iterator[Array]:
        kinematics = self._kinematics
        yield np.clip(seed_rad, kinematics.lower_rad, kinematics.upper_rad)
        # Fixed seed: the outcome belongs to the question, not to the moment.
        rng = np.random.default_rng(0)
        low, high = np.maximum(kinematics.lower_rad, -np.pi), np.minimum(kinematics.upper_rad, np.pi)
        for _ in range(20):
            yield rng.uniform(low, high)

    def _limited_step(
        self, q: Array, jacobian: Array, error: Array, reach_rad: Array, towards_posture: float
    ) -> tuple[Array, bool]:
        # A joint that stands outside already (an encoder's rounding is enough) may stay, and move inwards.
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
        """How far a redundant arm would go towards its posture in this step, were the tip not in the way."""
        if self._posture is None:
            return None
        pull: Array = (self._posture - q) * share
        excess = float((np.abs(pull) / reach_rad).max()) / _POSTURE_SHARE
        return pull / excess if excess > 1.0 else pull

    def _damped_least_squares(self, jacobian: Array, error: Array, pull: Array | None) -> tuple[Array, bool]:
        gram = np.einsum("ik,jk->ij", jacobian, jacobian)
        gram.flat[:: len(gram) + 1] += _DAMPING
        factors = LLT(gram)
        # As above: the diagonal of the Cholesky factor.
        manipulability = prod(factors.matrixLLT().diagonal().tolist())
        singular = manipulability < _SINGULAR
        if singular:
            gram.flat[:: len(gram) + 1] += _MAX_DAMPING * (1.0 - manipulability / _SINGULAR) ** 2
            factors = LLT(gram)
        if pull is None:
            return np.einsum("ij,i->j", jacobian, factors.solve(error)), singular
        # Of all steps that do it, the one nearest to the pull: its share that moves the tip is taken out again.
        rest = error - np.einsum("ij,j->i", jacobian, pull)
        return pull + np.einsum("ij,i->j", jacobian, factors.solve(rest)), singular


def _axis_error(tip: pin.SE3, target: pin.SE3) -> Array:
    """Like ``Kinematics.tip_error`` without the rotation about the tool axis, (5,)."""
    target_in_tip = tip.actInv(target)
    x, y, z = target_in_tip.rotation[:, 2].tolist()
    turn = (-y, x) if z > 0.0 else (1.0, 0.0)
    return np.concatenate((target_in_tip.translation, turn))
