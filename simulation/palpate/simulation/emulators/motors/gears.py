"""How the encoder counts of the Zebra Zero's six motors depend on its joint angles."""

from math import pi
from typing import Final

import numpy as np
import numpy.typing as npt

from palpate.core.ports import JointVector

AXES: Final = 6
HOME_RAD: Final[JointVector] = (0.0, pi / 2, -pi / 2, 0.0, -pi / 2, 0.0)
"""Joint angles at which the encoders are zero at power-up (FACT, brendandburns/ros2_zebra_zero)."""
ARM_COUNTS_PER_rad: Final = 30_557.75
"""Joints 1 to 3 (FACT, brendandburns/zebra-zero and ros2_zebra_zero; CALC: 192 000 counts a turn)."""
WRIST_COUNTS_PER_rad: Final = 11_034.53
"""Base ratio of the wrist's gears (FACT, same sources; CALC: 69 332 counts a turn)."""


class ArmGears:
    """Counts to joint angles and back, by one matrix and its exact inverse.

    The motors of the wrist sit behind joint 3 and drive through one another, so joint 3 turns all three of them and
    the wrist's joints need two or three motors each (FACT, forward relations of brendandburns/ros2_zebra_zero, whose
    rounded inverse agrees with this one within a count).
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
        """Encoder counts from home, (6,), unrounded."""
        offsets = [angle - home for angle, home in zip(joints_rad, HOME_RAD, strict=True)]
        return tuple(_product(row, offsets) for row in self._counts_per_rad)

    def joints_rad(self, counts: tuple[float, ...]) -> JointVector:
        """Joint angles, (6,) rad."""
        values = list(counts)
        return tuple(home + _product(row, values) for home, row in zip(HOME_RAD, self._rad_per_count, strict=True))


def _rows(matrix: npt.NDArray[np.float64]) -> tuple[tuple[tuple[int, float], ...], ...]:
    """The matrix without what is zero; the inverse's rounding residues count as zero."""
    return tuple(
        tuple((i, float(value)) for i, value in enumerate(row) if abs(value) > 1e-12 * np.abs(matrix).max())
        for row in matrix
    )


def _product(row: tuple[tuple[int, float], ...], values: list[float]) -> float:
    return sum(factor * values[i] for i, factor in row)
