"""Requests from the host and replies from the board.

FACT (README of jr3-mbed-firmware-can): an acknowledgement carries the sensor's state, but does not identify its
command. Therefore only one request may be pending.
"""

import enum
from dataclasses import dataclass
from typing import TypeAlias

from palpate.drivers.device import Vector3
from palpate.drivers.errors import DeviceFaultError

Counts3: TypeAlias = tuple[int, int, int]


class Op(enum.IntEnum):
    """Commands to the board. A command frame's identifier is the command's value plus the node number.

    The synchronous mode is not used: CANopen's SYNC has the same identifier, 0x080, so an arm on the same bus would
    trigger the sensor (FACT, same source).
    """

    START = 0x200
    STOP = 0x280
    GET_STATE = 0x400
    GET_FORCE_SCALES = 0x480
    GET_MOMENT_SCALES = 0x500


SCALES_IN_REPLY = {Op.GET_FORCE_SCALES: 3, Op.GET_MOMENT_SCALES: 3}
"""Number of full-scale values in an operation's acknowledgement; 0 for operations that are not listed."""


@dataclass(frozen=True, slots=True)
class Ack:
    """The board's acknowledgement that it has accepted a command.

    Attributes:
        ready: False if the sensor is not initialised. The board acknowledges commands even then, with stale full-scale
            values (FACT, jr3-mbed-firmware-can main.cpp).
        scales: Full-scale values, (0,) or (3,): N for forces, 0.1 N m for moments.
    """

    ready: bool
    scales: tuple[int, ...] = ()


@dataclass(frozen=True, slots=True)
class Bootup:
    """Message announcing that the board has just started; all settings and the zero are lost."""


@dataclass(frozen=True, slots=True)
class Reading:
    """A complete reading in counts, forces first, (6,), in the sensor's axes, and its frame counter, 0 to 65535."""

    counts: tuple[int, ...]
    counter: int


Message: TypeAlias = Ack | Bootup | Reading


Signs: TypeAlias = tuple[int, int, int, int, int, int]

LEFT_HANDED: Signs = (-1, 1, 1, -1, 1, 1)
"""Signs that make a JR3's left-handed axes right-handed. FACT: yarp-devices (Jr3Mbed, Jr3Pci) negates Fx and Mx.

INFERENCE: this is right if moments follow the right-hand rule about each of the sensor's axes. If a sensor computes its
moments as r x F in its own left-handed axes instead, the signs are (-1, 1, 1, 1, -1, -1). Check with known pushes,
starting with the sensor upright and unloaded: a weight of m kg hung at +0.1 m along each axis that points sideways must
change the force by 9.81 m N downwards and the moments by r x F, with the lever arm r in right-handed axes. Fx, Fy and
Fz show the sign of each axis, and the moments show which of the two sets applies.
"""

RIGHT_HANDED: Signs = (1, 1, 1, 1, 1, 1)
"""Signs for a board that already reports right-handed axes."""

FULL_SCALE_COUNTS = 16384
"""Counts at full scale (FACT, comedi jr3_pci driver). A 16-bit number reaches twice the full scale (CALC)."""

NEAR_SATURATION_COUNTS = 26214
"""Counts on any axis, 80 % of 32768, above which a reading counts as saturated.

FACT (comedi jr3_pci driver): the JR3 processor warns at this level, but for *raw* channels. Each axis of the decoupled
data is a mixture of all channels, one of which may be clipped while the mixture looks harmless. The board sends
decoupled, filtered data, which also hides short peaks. Its conversion to 16 bits does not clip (INFERENCE from its
utils.cpp): beyond twice the full scale, the number wraps.
"""


@dataclass(frozen=True, slots=True)
class FullScales:
    """Full-scale value for each axis; no other values identify a board.

    FACT: forces in N, moments in 0.1 N m (comedi jr3_pci driver, units word 1). Values of two sensors in can-plotter.py
    of jr3-mbed-firmware-can: (115, 111, 185) N with (56, 52, 61), and (317, 314, 845) N with (221, 219, 307).

    Attributes:
        force_N: Fx, Fy, Fz.
        moment_dNm: Mx, My, Mz in tenths of a newton metre.

    Raises:
        DeviceFaultError: A full scale is 0, so every reading would be 0.
    """

    force_N: Counts3
    moment_dNm: Counts3

    def __post_init__(self) -> None:
        if min(*self.force_N, *self.moment_dNm) <= 0:
            problem = f"reports full scales of {self.force_N} N and {self.moment_dNm} x 0.1 N m"
            raise DeviceFaultError("JR3", problem, "check the sensor's cable and power the board again")

    def wrench(self, counts: tuple[int, ...], signs: Signs) -> tuple[Vector3, Vector3]:
        """Return the force in N and the moment in N m.

        FACT: F = counts x full scale / 16384, M = counts x full scale in 0.1 N m / 163840.
        """
        axes = zip(counts, signs, (*self.force_N, *self.moment_dNm), strict=True)
        fx, fy, fz, mx, my, mz = (count * sign * scale for count, sign, scale in axes)
        force, moment = FULL_SCALE_COUNTS, 10 * FULL_SCALE_COUNTS
        return (fx / force, fy / force, fz / force), (mx / moment, my / moment, mz / moment)
