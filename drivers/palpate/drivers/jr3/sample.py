"""One sample of the sensor, in physical units."""

from __future__ import annotations

from dataclasses import dataclass

from palpate.drivers.jr3.scaling import Vector3


@dataclass(frozen=True, slots=True)
class Jr3Sample:
    """A reading as the driver's user sees it.

    Attributes:
        force_N: Force, (3,), in the sensor's axes made right-handed.
        torque_Nm: Moment about the sensor's origin, (3,), in the same axes.
        counter: Frame counter of the board, 0 to 65535.
        sequence: The counter unwrapped: always increases, also across restarts of the board.
        receive_time_ns: Clock of the poll that found the sample; it is older by the wait for that poll, the wire and
            the filter's delay (CALC: about 1/(2 pi cut-off)).
        over_range: Beyond full scale on an axis, where the calibration ends.
        near_saturated: Beyond 80 % of the converter's range; treat as saturated (see
            :mod:`~palpate.drivers.jr3.scaling`). saturated: At the end of the converter's range. settling: Within five
            time constants of the filter after a start or a zeroing; the filter starts from 0. after_boot: The board
            restarted in mid-run and nobody has acknowledged it yet. zero_lost: A zero that was set on request is gone
            and nobody has acknowledged it yet.
    """

    force_N: Vector3
    torque_Nm: Vector3
    counter: int
    sequence: int
    receive_time_ns: int
    over_range: bool = False
    near_saturated: bool = False
    saturated: bool = False
    settling: bool = False
    after_boot: bool = False
    zero_lost: bool = False
