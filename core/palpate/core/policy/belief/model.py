"""The contact model, which predicts the torque at a given distance and direction from the hole.

::

    torque = load * (cue(distance) turned to the hole's heading + residual(distance, sector)) + noise
             + (1 + load * gain(distance)) times the torque caused by the tilt, along and across that heading

The load is the pressing force divided by 4.9 N. No relation between torque and direction is built in: the cue is
learned and shared across all headings, as for a round peg; the residual contains deviations from that. All quantities
are given for a few distance rings and interpolated linearly.

A tool tilted in its grip makes contact with an edge, which adds a torque to every contact, the trial's bias; if the
hole is under that edge, another edge carries the load. To first order in the tilt a round peg has no other effect: by
symmetry the torque is linear in that bias, with different gains along and across the heading. Observations at one
tilt heading therefore apply to all. After a regrip, only two numbers are unknown, and the belief integrates them
out. A zero offset of the sensor is a bias of this kind without a gain.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from math import cos, pi, sin
from typing import Final

import numpy as np

from palpate.core.policy.belief.arithmetic import Floats

RINGS_M: Final = (0.0, 2.5e-4, 5e-4, 8e-4, 1.2e-3, 1.8e-3, 2.6e-3, 3.6e-3, 5e-3, 7.5e-3)
SECTORS: Final = 12
_KNOTS: Final = np.array(RINGS_M)
_EDGES: Final = np.array([(cos(2 * pi * k / SECTORS), sin(2 * pi * k / SECTORS)) for k in range(SECTORS + 1)])

Pair = tuple[float, float]


@dataclass(frozen=True, slots=True)
class Directions:
    """Displacements to the hole, in the coordinates used by the model's tables.

    Attributes:
        ring: Ring below each distance, (n,).
        share: Position of each distance between that ring and the next one, 0 to 1, (n,).
        sector: Sector for each heading, (n,).
        unit: Each heading as a unit vector, (n, 2); the x axis if the distance is zero.
    """

    ring: np.ndarray
    share: Floats
    sector: np.ndarray
    unit: Floats

    @classmethod
    def of(cls, x_m: Floats, y_m: Floats) -> Directions:
        """Convert displacements from the tip to the hole, (n,) each, to these coordinates."""
        distance = np.sqrt(x_m * x_m + y_m * y_m)
        ring = np.searchsorted(_KNOTS, distance, side="right") - 1
        ring = np.minimum(ring, len(RINGS_M) - 2)
        share = np.minimum((distance - _KNOTS[ring]) / (_KNOTS[ring + 1] - _KNOTS[ring]), 1.0)
        somewhere = distance > 0.0
        divisor = np.where(somewhere, distance, 1.0)
        ux, uy = np.where(somewhere, x_m / divisor, 1.0), y_m / divisor
        sector = np.zeros(len(distance), dtype=int)
        for k, ((ax, ay), (bx, by)) in enumerate(pairwise(_EDGES)):
            sector[(ax * uy - ay * ux >= 0.0) & (bx * uy - by * ux < 0.0)] = k
        return cls(ring, share, sector, np.stack((ux, uy), axis=1))

    def between(self, table: Floats) -> Floats:
        """Interpolate linearly between the rings of a table (rings, ...)."""
        share = self.share.reshape(-1, *(1,) * (table.ndim - 1))
        at: Floats = (1.0 - share) * table[self.ring] + share * table[self.ring + 1]
        return at

    def between_cells(self, table: Floats) -> Floats:
        """Interpolate a table (rings, sectors, k) between rings, in the sector of each displacement: (n, k)."""
        share = self.share[:, None]
        at: Floats = (1.0 - share) * table[self.ring, self.sector] + share * table[self.ring + 1, self.sector]
        return at

    def turned(self, vectors: Floats) -> Floats:
        """Convert components along and across the heading, (n, 2), to x and y components."""
        c, s = self.unit[:, 0], self.unit[:, 1]
        along, across = vectors[:, 0], vectors[:, 1]
        return np.stack((along * c - across * s, along * s + across * c), axis=1)

    def turned_back(self, vectors: Floats) -> Floats:
        """Convert x and y components, (n, 2), to components along and across the heading."""
        c, s = self.unit[:, 0], self.unit[:, 1]
        x, y = vectors[:, 0], vectors[:, 1]
        return np.stack((x * c + y * s, y * c - x * s), axis=1)


@dataclass(frozen=True, slots=True)
class ContactModel:
    """A fitted contact model, with cue and residual for a pressing force of 4.9 N.

    Attributes:
        lag: Torque lag behind the commanded tip, as a fraction of the last step.
        offset_Nm: Torque caused by the tilt in the last trials, (2,).
        cue_Nm: Torque along and across the hole's heading, at each ring, (rings, 2).
        residual_Nm: Residual left by the cue, at each ring and sector, (rings, sectors, 2).
        noise_Nm: Standard deviation of each component, at each ring, (rings,).
        bias_Nm: Trial-to-trial standard deviation of each component of the torque caused by the tilt.
        gain: Relative increase in that torque along and across the hole's heading, at each ring, (rings, 2).
        spread_Nm: Standard deviation of each component of the torque caused by an unknown tilt.
    """

    lag: float
    offset_Nm: Pair
    cue_Nm: tuple[Pair, ...]
    residual_Nm: tuple[tuple[Pair, ...], ...]
    noise_Nm: tuple[float, ...]
    bias_Nm: float
    contacts: int
    gain: tuple[Pair, ...]
    spread_Nm: float

    def upright_Nm(self, directions: Directions) -> Floats:
        """Return the torque on an upright tool at each displacement for a pressing force of 4.9 N, (n, 2)."""
        cue = directions.turned(directions.between(np.array(self.cue_Nm)))
        expected: Floats = cue + directions.between_cells(np.array(self.residual_Nm))
        return expected

    def variance(self, directions: Directions) -> Floats:
        """Return the variance of each torque component in a contact, in N m squared, (n,)."""
        return directions.between(np.square(np.array(self.noise_Nm)))
