"""Motors driven by the emulated servos, and the gears between the motors and the arm."""

from collections.abc import Sequence
from math import pi
from typing import Final

import numpy as np
import numpy.typing as npt

from palpate.core.ports import JointVector

AXES: Final = 6
HOME_RAD: Final[JointVector] = (0.0, pi / 2, -pi / 2, 0.0, -pi / 2, 0.0)
"""Joint angles at which the encoders read zero at power-up (FACT, brendandburns/ros2_zebra_zero)."""
ARM_COUNTS_PER_rad: Final = 30_557.75
"""Ratio for joints 1 to 3 (FACT, brendandburns/zebra-zero and ros2_zebra_zero; CALC: 192 000 counts per turn)."""
WRIST_COUNTS_PER_rad: Final = 11_034.53
"""Base ratio for the wrist's gears (FACT, same sources; CALC: 69 332 counts per turn)."""


class ArmGears:
    """Conversion between counts and joint angles with a matrix and its exact inverse.

    The wrist motors are coupled to joint 3 and to one another: joint 3 turns all three, and each wrist joint needs two
    or three motors (FACT, forward relations of brendandburns/ros2_zebra_zero, whose rounded inverse agrees with this
    one to within a count).
    """

    def __init__(self) -> None:
        in_wrist_units = np.array(
            [
                # joint 3, 4, 5, 6
                [+1.5, 1.0, 0.0, 0.0],
                [-1.5, 1.0, 2.0, -1.0],
                [-1.5, -0.5, 1.0, 0.5],
            ]
        )
        forward = np.zeros((AXES, AXES))
        forward[:3, :3] = np.eye(3) * ARM_COUNTS_PER_rad
        forward[3:, 2:] = in_wrist_units * WRIST_COUNTS_PER_rad
        self._counts_per_rad = _rows(forward)
        self._rad_per_count = _rows(np.asarray(np.linalg.inv(forward), dtype=np.float64))

    def counts(self, joints_rad: JointVector) -> tuple[float, ...]:
        """Return encoder counts from home, (6,), not rounded."""
        offsets = [angle - home for angle, home in zip(joints_rad, HOME_RAD, strict=True)]
        return tuple(_product(row, offsets) for row in self._counts_per_rad)

    def joints_rad(self, counts: tuple[float, ...]) -> JointVector:
        """Return joint angles, (6,) rad."""
        values = list(counts)
        return tuple(home + _product(row, values) for home, row in zip(HOME_RAD, self._rad_per_count, strict=True))


def _rows(matrix: npt.NDArray[np.float64]) -> tuple[tuple[tuple[int, float], ...], ...]:
    """Return the non-zero elements of the matrix. Rounding errors from the inversion are treated as zero."""
    return tuple(
        tuple((i, float(value)) for i, value in enumerate(row) if abs(value) > 1e-12 * np.abs(matrix).max())
        for row in matrix
    )


def _product(row: tuple[tuple[int, float], ...], values: list[float]) -> float:
    return sum(factor * values[i] for i, factor in row)


class DirectGears:
    """Gearing with one motor per joint. Zero counts correspond to a zero angle."""

    def __init__(self, counts_per_rad: Sequence[float]) -> None:
        self._scale = counts_per_rad

    def counts(self, joints_rad: JointVector) -> tuple[float, ...]:
        """Return encoder counts, (n,), not rounded."""
        return tuple(q * k for q, k in zip(joints_rad, self._scale, strict=True))

    def joints_rad(self, counts: tuple[float, ...]) -> JointVector:
        """Return joint angles, (n,) rad."""
        return tuple(count / k for count, k in zip(counts, self._scale, strict=True))


class JointPlant:
    """Motors controlled by emulated servos and drives. They move an arm that is simulated elsewhere, such as in MuJoCo.

    A motor is either held at a set-point or free. All methods are called from the thread that runs the servos.

    In each control tick of that simulation, command its joint servos with `targets_rad()`, step it, and pass its exact
    joint angles to `measured_rad()`. The encoders report these angles, so their counts are constant between control
    ticks while the set-points move. The position error limit must allow for this. The velocity reported by the modules
    has the same steps.
    """

    def __init__(self, joints_rad: JointVector = HOME_RAD, gears: ArmGears | DirectGears | None = None) -> None:
        self._gears = gears or ArmGears()
        self._motors = list(self._gears.counts(joints_rad))
        self._driven, self._held = list(self._motors), [False] * len(joints_rad)

    def set_motor_counts(self, axis: int, counts: float) -> None:
        """Set the position, in counts, that an axis's servo holds; axes are numbered from 0."""
        self._driven[axis], self._held[axis] = counts, True

    def release(self, axis: int) -> None:
        """Release an axis's motor."""
        if self._held[axis]:
            self._driven[axis], self._held[axis] = self._motors[axis], False

    def motor_counts(self, axis: int) -> int:
        """Return the counts from the encoder on the motor shaft."""
        return round(self._motors[axis])

    def targets_rad(self) -> JointVector:
        """Return the joint set-points that the motors hold, (n,) rad. A free motor keeps its position (INFERENCE)."""
        return self._gears.joints_rad(tuple(self._driven))

    def measured_rad(self, joints_rad: JointVector) -> None:
        """Set the true joint angles, (n,) rad."""
        self._motors = list(self._gears.counts(joints_rad))
