"""Motors that each turn one joint alone, and drive an arm simulated elsewhere."""

from __future__ import annotations

from palpate.core.ports.values import JointVector


class DirectMotors:
    """Motors as emulated drives see them, in counts, in front of an arm that another simulation moves in radians.

    Args:
        counts_per_rad: Counts per radian of each joint.
        joints_rad: Where the arm is, (n,) rad; zero counts are angle zero.
    """

    def __init__(self, counts_per_rad: tuple[float, ...], joints_rad: JointVector) -> None:
        self._scale = counts_per_rad
        self._targets = [q * k for q, k in zip(joints_rad, counts_per_rad, strict=True)]
        self._measured = [round(counts) for counts in self._targets]

    def set_motor_counts(self, axis: int, counts: float) -> None:
        """The servo of this axis now holds this position."""
        self._targets[axis] = counts

    def motor_counts(self, axis: int) -> int:
        """What the encoder of this axis counts."""
        return self._measured[axis]

    def advance(self, now_ns: int) -> None:
        """Time passes in the other simulation."""

    def targets_rad(self) -> JointVector:
        """Joint set-points that the motors hold now, (n,) rad."""
        return tuple(counts / k for counts, k in zip(self._targets, self._scale, strict=True))

    def measured_rad(self, joints_rad: JointVector) -> None:
        """Feed back where the joints are, (n,) rad."""
        self._measured = [round(q * k) for q, k in zip(joints_rad, self._scale, strict=True)]
