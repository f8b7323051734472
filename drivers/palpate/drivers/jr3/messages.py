"""What host and board say to each other, whatever the wire: requests, and what comes back.

FACT (READMEs of jr3-mbed-firmware-can and -uart): an acknowledgement carries the sensor's state, but neither the
command that it answers nor anything to tell two of them apart. So only one request may be in flight.
"""

from __future__ import annotations

import enum
from dataclasses import dataclass
from typing import TypeAlias

Counts3: TypeAlias = tuple[int, int, int]


class Op(enum.Enum):
    """A command to the board.

    The synchronous mode is left out: CANopen's SYNC has the same identifier, 0x080, so that an arm on the same bus
    would trigger the sensor (FACT, same sources).
    """

    GET_STATE = "get state"
    GET_SCALES = "get full scales"
    GET_FORCE_SCALES = "get full scales of forces"
    GET_MOMENT_SCALES = "get full scales of moments"
    START = "start"
    STOP = "stop"
    ZERO = "zero offsets"
    SET_FILTER = "set filter"
    RESET = "reset"


SCALES_IN_REPLY = {Op.GET_SCALES: 6, Op.GET_FORCE_SCALES: 3, Op.GET_MOMENT_SCALES: 3}
"""How many full scales the acknowledgement of an operation carries; 0 where none is named."""


@dataclass(frozen=True, slots=True)
class Request:
    """A command with its arguments.

    Attributes:
        op: The command.
        cutoff_cHz: Cut-off of the low-pass filter in hundredths of a hertz, 0 = unfiltered; START and SET_FILTER.
        period_us: Time between readings in microseconds; START.
    """

    op: Op
    cutoff_cHz: int = 0
    period_us: int = 0


@dataclass(frozen=True, slots=True)
class Ack:
    """The board took a command.

    Attributes:
        ready: False when the sensor is not initialised. The board acknowledges commands even then, and what it says of
            full scales is stale (FACT, jr3-mbed-firmware-can main.cpp).
        scales: Full scales, (0,), (3,) or (6,): N for forces, 0.1 N m for moments.
    """

    ready: bool
    scales: tuple[int, ...] = ()


@dataclass(frozen=True, slots=True)
class Bootup:
    """The board has just started, and with it all settings and the zero are gone."""


@dataclass(frozen=True, slots=True)
class Forces:
    """Half a reading: Fx, Fy, Fz in counts, and the frame counter, 0 to 65535."""

    counts: Counts3
    counter: int


@dataclass(frozen=True, slots=True)
class Moments:
    """The other half: Mx, My, Mz in counts, and the frame counter, 0 to 65535."""

    counts: Counts3
    counter: int


@dataclass(frozen=True, slots=True)
class Reading:
    """A whole reading in counts, in the sensor's own axes, and its frame counter, 0 to 65535."""

    forces: Counts3
    moments: Counts3
    counter: int


Message: TypeAlias = Ack | Bootup | Reading
