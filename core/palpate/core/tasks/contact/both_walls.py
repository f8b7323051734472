"""Is the peg between two walls? The lateral force follows pushes to and fro, as no recording and no noise does."""

import enum
from math import dist, hypot
from typing import Final

from palpate.core.ports import CONTROL_RATE_HZ, Vector3
from palpate.core.tasks.contact.axial_check import Mean
from palpate.core.tasks.contact.wall_check import ANSWER_N, BEND_M, SPEED_M_S, WallCheck

_PUSHED_N: Final = 2.0 * ANSWER_N
"""The push to the other wall ends where the force has changed by so much: an answer of each."""
FOLLOWED_N: Final = 1.6
"""Least change between the rests at two walls; with noise of 0.3 N an honest one has a standard deviation of 0.15 N."""
_MOVING_SAMPLES: Final = 4
_REST_TICKS: Final = 4
"""Ticks of rest after a motion, for the lag of servos and sensor."""
_ARRIVED_M: Final = 3e-5
_LONGEST_WAIT_TICKS: Final = CONTROL_RATE_HZ // 4
"""A rest begins when encoders show the tip as near as that to where it was led, or after so long: an arm that smoothes
its set-points is under way for another tenth of a second."""
_RESTING_SAMPLES: Final = 8
"""So many twice: first and second half of a rest are held against each other."""
_STEADY_N: Final = 0.6
"""At rest a force changes by less; what ended a push at its peak does not stay there."""
_SAME_SHARE: Final = 0.3
"""Where the tool was before, the force is the same to this share of what the walls differ by; friction keeps some."""
_WAITS: Final = (0, 20, 47)
"""Ticks before each way back to where the force was measured before. They are uneven: of a force that swings by itself
pushes that end when it has swung find the period, and with even ones it would go on to answer."""


class _WallStage(enum.Enum):
    FIRST = "first"
    REST = "rest"
    PUSH = "push"
    BACK = "back"


class BothWallsCheck:
    """Pushes to a wall, to the one opposite, and back to both: there the force has to be what it was.

    Attributes:
        first: The push to the first wall.
        answered: Whether the force followed all the way.
        failed: Whether it did not, was not steady at rest, or the peg went further than the hole's play.
        forces_N: Force along the first push at each rest.
    """

    def __init__(self, play_m: float) -> None:
        self.first, self._reach_m = WallCheck(play_m), play_m + 2.0 * BEND_M
        self._half_N: float | None
        self._mean: Mean

    def begin(self, from_m: Vector3) -> None:
        """The next :meth:`velocity_m_s` is the first of a check; way counts from this place, (3,), task frame."""
        self.answered = self.failed = False
        self.forces_N: list[float] = []
        self.first.begin(from_m)
        self._places_m: list[Vector3] = []
        self._enter(_WallStage.FIRST)

    def velocity_m_s(self, force_N: Vector3, new: bool, reference_m: Vector3, tip_m: Vector3) -> tuple[float, float]:
        """Velocity of the tip across the tool axis for this tick; not to be asked once it is known.

        Args:
            force_N: Tared force of the environment on the tool, (3,), task frame.
            reference_m: Where the tip is commanded to be, (3,), task frame.
            tip_m: Where it is by the encoders, (3,), task frame.
        """
        if self._stage is _WallStage.FIRST:
            velocity = self.first.velocity_m_s(force_N, new, reference_m)
            self.failed = self.first.failed
            if self.first.answered:
                self._enter(_WallStage.REST)
            return velocity
        self._ticks += 1
        ux, uy = self.first.way
        if self._stage is _WallStage.BACK:
            return self._go_back(reference_m)
        along_N = force_N[0] * ux + force_N[1] * uy
        if self._stage is _WallStage.REST:
            self._arrived |= dist(tip_m[:2], reference_m[:2]) <= _ARRIVED_M or self._ticks > _LONGEST_WAIT_TICKS
            resting = self._arrived and self._ticks > _REST_TICKS
            if resting and self._mean.add(along_N, new) == _RESTING_SAMPLES:
                self._rested_half(reference_m)
            return 0.0, 0.0
        if self._mean.add(along_N, new) == _MOVING_SAMPLES:
            pushed, self._mean = self._mean.value - self.forces_N[0] >= _PUSHED_N, Mean()
            far = dist(reference_m[:2], self._places_m[0][:2]) > self._reach_m
            if pushed or far or self.first.past(-ux, -uy, reference_m):
                self._enter(_WallStage.REST)
                return 0.0, 0.0
        return -SPEED_M_S * ux, -SPEED_M_S * uy

    def _go_back(self, reference_m: Vector3) -> tuple[float, float]:
        """Waits, then goes to where the force was measured twice before."""
        count = len(self.forces_N)
        if self._ticks <= _WAITS[count - 2]:
            return 0.0, 0.0
        to_m = self._places_m[count - 2]
        dx, dy = to_m[0] - reference_m[0], to_m[1] - reference_m[1]
        left_m = hypot(dx, dy)
        if left_m < 1e-9:
            self._enter(_WallStage.REST)
            return 0.0, 0.0
        speed_m_s = min(SPEED_M_S, left_m * CONTROL_RATE_HZ)
        return speed_m_s * dx / left_m, speed_m_s * dy / left_m

    def _rested_half(self, reference_m: Vector3) -> None:
        half_N, self._mean = self._mean.value, Mean()
        if self._half_N is None:
            self._half_N = half_N
            return
        self.forces_N.append(0.5 * (self._half_N + half_N))
        self._places_m.append(reference_m)
        self.failed = abs(half_N - self._half_N) > _STEADY_N or not self._followed()
        self.answered = not self.failed and len(self.forces_N) == 2 + len(_WAITS)
        self._enter(_WallStage.PUSH if len(self.forces_N) == 1 else _WallStage.BACK)

    def _followed(self) -> bool:
        """Whether the newest force at rest is what the way there gives."""
        match self.forces_N:
            case [first_N, other_N]:
                return other_N - first_N >= FOLLOWED_N
            case [first_N, other_N, *_]:
                change_N = abs(self.forces_N[-1] - self.forces_N[-3])
                return change_N <= _SAME_SHARE * (other_N - first_N)
        return True

    def _enter(self, stage: _WallStage) -> None:
        self._stage, self._ticks, self._half_N, self._mean, self._arrived = stage, 0, None, Mean(), False
