"""Convert between encoder counts and joint angles, including the coupled wrist.

FACT (client and port agree): with the joint angles measured from the home pose, d = q - home,

    e1..3 = C d1..3
    e4 =  1.5 W d3 + W d4
    e5 = -1.5 W d3 + W d4 + 2 W d5 - W d6
    e6 = -1.5 W d3 + W d5 + W (d6 - d4) / 2

CALC: 2 pi C is 192 000 and 2 pi W is 69 332 counts per turn. The inverse below is exact, derived from C and W alone;
the sources use individually rounded constants, which differ by about 2e-7 rad.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite, pi
from typing import Final, TypeAlias

from palpate.drivers.errors import RefusedError

DEVICE: Final = "Zebra Zero"
JOINTS: Final = 6
HOME_RAD: Final = (0.0, pi / 2, -pi / 2, 0.0, -pi / 2, 0.0)
"""Joint angles of the home pose, in which the arm rests when its counters are zeroed. FACT: client and port."""

ARM_COUNTS_PER_RAD: Final = 30557.75
"""C, the ratio for joints 1 to 3. FACT: client and port."""
WRIST_COUNTS_PER_RAD: Final = 11034.53
"""W, the base ratio for the wrist. FACT: client and port."""
ALTERNATIVE_WRIST_FACTOR: Final = 24.0 / 17.33
"""Factor applied to the counts of motors 4 to 6 with the other gearhead. FACT: client."""

Six: TypeAlias = tuple[float, float, float, float, float, float]
SixCounts: TypeAlias = tuple[int, ...]
"""Counts for the six motors."""


def six(values: Sequence[float]) -> Six:
    """Return the values; raise an error unless they are six finite numbers."""
    if len(values) != JOINTS or not all(isfinite(value) for value in values):
        raise RefusedError(DEVICE, f"{values} are not {JOINTS} finite angles", "correct the caller; nothing was sent")
    a, b, c, d, e, f = (float(value) for value in values)
    return a, b, c, d, e, f


@dataclass(frozen=True)
class Transmission:
    """Transmission between the motors and the joints.

    Attributes:
        joint_1_sign: 1, or -1 for a motor mounted upside down. FACT: 1 in the client, -1 in the newest port.
        wrist_factor: 1.0, or ``ALTERNATIVE_WRIST_FACTOR``.
    """

    joint_1_sign: int = 1
    wrist_factor: float = 1.0

    def to_counts(self, position_rad: Sequence[float]) -> SixCounts:
        """Return the nearest counter values for joint angles.

        Raises:
            RefusedError: The values are not six finite angles.
        """
        angles = six(position_rad)
        e1, e2, e3, e4, e5, e6 = self._motors(six([q - home for q, home in zip(angles, HOME_RAD, strict=True)]))
        return round(e1), round(e2), round(e3), round(e4), round(e5), round(e6)

    def to_rad(self, counts: Sequence[int]) -> Six:
        """Return the joint angles for counter values.

        Raises:
            RefusedError: The number of values is not six.
        """
        e1, e2, e3, e4, e5, e6 = six(counts)
        wrist = WRIST_COUNTS_PER_RAD * self.wrist_factor
        d1, d2, d3 = (e / ARM_COUNTS_PER_RAD for e in (self.joint_1_sign * e1, e2, e3))
        d4 = e4 / wrist - 1.5 * d3
        d5 = (e5 + 2.0 * e6) / (4.0 * wrist) + 1.125 * d3
        d6 = (2.0 * e6 - e5 + 2.0 * e4) / (2.0 * wrist) - 0.75 * d3
        return six([d + home for d, home in zip((d1, d2, d3, d4, d5, d6), HOME_RAD, strict=True)])

    def motor_rates(self, joint_rates: Sequence[float]) -> Six:
        """Return each motor's maximum velocity or acceleration in counts for joint rates (6,) in rad/s or rad/s2."""
        unit_rates = [self._motors(six([rate * (i == j) for i in range(JOINTS)])) for j, rate in enumerate(joint_rates)]
        return six([sum(abs(unit[axis]) for unit in unit_rates) for axis in range(JOINTS)])

    def _motors(self, delta_rad: Six) -> Six:
        d1, d2, d3, d4, d5, d6 = delta_rad
        wrist = WRIST_COUNTS_PER_RAD * self.wrist_factor
        return (
            self.joint_1_sign * ARM_COUNTS_PER_RAD * d1,
            ARM_COUNTS_PER_RAD * d2,
            ARM_COUNTS_PER_RAD * d3,
            wrist * (1.5 * d3 + d4),
            wrist * (-1.5 * d3 + d4 + 2.0 * d5 - d6),
            wrist * (-1.5 * d3 + d5 + 0.5 * (d6 - d4)),
        )
