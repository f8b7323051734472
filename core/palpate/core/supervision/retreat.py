"""The retraction after a trip, straight along the tool axis in its actual orientation."""

from math import ceil
from typing import Final

import numpy as np

from palpate.core.motion import InverseKinematics, Kinematics
from palpate.core.ports import JointVector

_THERE_M: Final = 1e-5


class Retreat:
    """Joint angles for the retraction, tick by tick; the tip never advances."""

    def __init__(self, kinematics: Kinematics, distance_m: float, speed_m_s: float, period_s: float) -> None:
        self._kinematics = kinematics
        self._inverse = InverseKinematics(kinematics, period_s)
        self._distance_m, self._step_m = distance_m, speed_m_s * period_s
        # An arm slower than the set speed gets twice the time.
        self._most_ticks = 2 * ceil(distance_m / self._step_m)
        self.finished: bool

    def start(self, held_rad: JointVector) -> None:
        """Start from the commanded joint angles, (n,)."""
        self._kinematics.update(held_rad)
        self._target = self._kinematics.tip_in_base
        self._start = self._target.copy()
        self._requested_m = self.travelled_m = 0.0
        self._ticks = 0
        self.finished = False

    def step(self, held_rad: JointVector) -> JointVector:
        """Return the next joint angles, (n,).

        Args:
            held_rad: The previous command, (n,).
        """
        self._ticks += 1
        self._requested_m = min(self._requested_m + self._step_m, self._distance_m)
        self._target.translation = self._start.act(np.array([0.0, 0.0, -self._requested_m]))
        q_rad, _ = self._inverse.step(held_rad, self._target)
        self._kinematics.update(q_rad)
        travelled = -float(self._kinematics.tip_in(self._start).translation[2])
        if not travelled >= self.travelled_m:
            # A joint limit or a singularity blocks the retraction: stop here rather than advance.
            self.finished = True
            return held_rad
        self.travelled_m = travelled
        self.finished = travelled >= self._distance_m - _THERE_M or self._ticks >= self._most_ticks
        return q_rad
