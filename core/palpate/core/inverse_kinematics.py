"""Inverse kinematics: damped least squares with joint limits, one step a control tick.

Our own few lines on Pinocchio's Jacobian rather than a quadratic program: the step has an exact answer for six
joints, costs a few microseconds, and its only inequality constraints are boxes on the joints
(``docs/decisions/0004-inverse-kinematics.md`` has the comparison with pin-pink).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np
import pinocchio as pin

from palpate.core.errors import UnreachableError
from palpate.core.kinematics import Array, Kinematics

_DAMPING: Final = 1e-12  # squared; small against 1, so that a step far from singularities is exact to 1e-9
_SINGULAR: Final = 2e-4  # below this product of singular values (m^3 rad^3 scale) the damping grows
_MAX_DAMPING: Final = 1e-2


@dataclass(frozen=True, slots=True)
class JointStep:
    """One step of the joints.

    Attributes:
        q_rad: New joint angles, (n,), inside all limits.
        limited: Whether a limit or a singularity kept the tip from getting all the way.
    """

    q_rad: Array
    limited: bool


class InverseKinematics:
    """Follows a moving tip placement with the joints.

    Args:
        kinematics: A work space of its own (it is changed by every call).
        period_s: Time between two steps; with the velocity limits it bounds each step.
    """

    def __init__(self, kinematics: Kinematics, period_s: float) -> None:
        # Imported here: scipy.linalg takes longer to load than all of the core.
        from scipy.linalg.lapack import dposv

        self._solve_spd = dposv
        self._kinematics = kinematics
        self._reach_rad: Array = kinematics.velocity_limit_rad_s * period_s

    def step(self, q_rad: Array, tip_target_in_base: pin.SE3) -> JointStep:
        """One Gauss-Newton step from ``q_rad`` towards a tip placement.

        Near a singularity the damping grows, so that the step stays bounded and loses accuracy instead. A joint at
        its limit is taken out and the others share its work. A step beyond the velocity limits is shortened as a
        whole, so that the tip keeps its direction.
        """
        kinematics = self._kinematics
        kinematics.update(q_rad)
        error: Array = pin.log6(kinematics.tip_in_base.actInv(tip_target_in_base)).vector
        return self._limited_step(q_rad, kinematics.tip_jacobian(q_rad), error)

    def solve(self, tip_target_in_base: pin.SE3, *, free_yaw: bool, seed_rad: Array, field: str) -> Array:
        """Joint angles that reach a placement, found by iteration from a seed.

        Args:
            tip_target_in_base: Where the tip shall be.
            free_yaw: Leave the rotation about the tool axis to the arm.
            seed_rad: Where to start, (n,); it picks the branch of the solution.
            field: The setting to name when there is no solution.

        Returns:
            Joint angles, (n,), tip within 1 micrometre and 1 microradian.

        Raises:
            UnreachableError: No configuration within the joint limits was found.
        """
        kinematics = self._kinematics
        rows = slice(0, 5) if free_yaw else slice(0, 6)
        for start in self._starts(seed_rad):
            q = start
            for _ in range(100):
                kinematics.update(q)
                tip = kinematics.tip_in_base
                error = pin.log6(tip.actInv(tip_target_in_base)).vector
                if free_yaw:
                    # Only the tool axis counts: the rotation that takes it to its target, in the tip frame.
                    axis = tip.rotation.T @ tip_target_in_base.rotation[:, 2]
                    error = np.concatenate((tip.rotation.T @ (tip_target_in_base.translation - tip.translation),
                                            np.array([-axis[1], axis[0]]) if axis[2] > 0 else np.array([1.0, 0.0])))
                if float(np.abs(error).max()) < 1e-6:
                    return q
                q = self._limited_step(q, kinematics.tip_jacobian(q)[rows], error, reach=np.full(q.shape, 0.3)).q_rad
        position = ", ".join(f"{value:.4g}" for value in tip_target_in_base.translation)
        raise UnreachableError(
            field, f"({position}) m", f"a place that {self._kinematics.arm.name} reaches with its tool axis as asked"
        )

    def _starts(self, seed_rad: Array) -> Iterator[Array]:
        yield seed_rad
        # Fixed seed: the outcome belongs to the question, not to the moment.
        rng = np.random.default_rng(0)
        low, high = np.maximum(self._kinematics.lower_rad, -np.pi), np.minimum(self._kinematics.upper_rad, np.pi)
        for _ in range(20):
            yield rng.uniform(low, high)

    def _limited_step(self, q: Array, jacobian: Array, error: Array, reach: Array | None = None) -> JointStep:
        kinematics = self._kinematics
        free = jacobian
        limited = False
        for _ in range(kinematics.joints):
            dq, singular = self._damped_least_squares(free, error)
            limited = limited or singular
            target = q + dq
            beyond = (target < kinematics.lower_rad) | (target > kinematics.upper_rad)
            if not beyond.any():
                break
            limited = True
            free = np.where(beyond, 0.0, free)
        else:
            dq = np.zeros_like(q)
        excess = float((np.abs(dq) / (self._reach_rad if reach is None else reach)).max())
        if excess > 1.0:
            dq, limited = dq / excess, True
        return JointStep(q + dq, limited)

    def _damped_least_squares(self, jacobian: Array, error: Array) -> tuple[Array, bool]:
        gram = jacobian.dot(jacobian.T)
        gram.flat[:: len(gram) + 1] += _DAMPING
        factor, solution, _ = self._solve_spd(gram, error)
        # The product of the Cholesky diagonal is the product of the singular values: manipulability for free.
        manipulability = float(factor.diagonal().prod())
        if manipulability >= _SINGULAR:
            return jacobian.T.dot(solution), False
        gram.flat[:: len(gram) + 1] += _MAX_DAMPING * (1.0 - manipulability / _SINGULAR) ** 2
        _, solution, _ = self._solve_spd(gram, error)
        return jacobian.T.dot(solution), True
